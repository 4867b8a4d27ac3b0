"""Pictures with depth, and kernels: the numbers of the command line, from files and from arrays."""

import json
import math
import os
import pickle
import tempfile
import unittest

import numpy as np
from quadpixel import Camera, Configuration, Picture, Pictures, Pixel, Scene
from test_simulation import LENS, QPGEN, contents, run

try:
    import jax
except ImportError:
    jax = None

HERE = os.path.dirname(os.path.abspath(__file__))
SIZE = (16, 24)


def camera(**changes):
    return Camera(LENS, Pixel.ideal(4.0), **{"focus_mm": 400.0, **changes})


def picture():
    """A picture of codes with a card before a wall, in mm."""
    rng = np.random.default_rng(3)
    depth = np.full(SIZE, 440, dtype=np.uint16)
    depth[4:12, 6:14] = 375
    return rng.integers(0, 256, (*SIZE, 3), dtype=np.uint8), depth


class Converting(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def files(self):
        light, depth = picture()
        paths = []
        for name, array in (("image", light), ("depth", depth)):
            os.mkdir(os.path.join(self.folder, name))
            paths.append(os.path.join(self.folder, name, "one.npy"))
            np.save(paths[-1], array)
        return paths

    def test_files_give_the_bytes_of_the_command_line(self):
        image, depth = self.files()
        sample = camera().convert(image, depth, unit="mm")
        sample.write(os.path.join(self.folder, "python"))
        run(QPGEN, "render", os.path.join(self.folder, "python", "meta.json"), "--out", os.path.join(self.folder, "program"))
        self.assertEqual(contents(os.path.join(self.folder, "python")), contents(os.path.join(self.folder, "program")))
        near = sample["valid"] & (sample["depth"] < 0.4)
        self.assertTrue(near.any() and (sample["left_right"][near] > 0).all())
        self.assertTrue((sample["left_right"][sample["valid"] & ~near] < 0).all())

    def test_arrays_give_the_numbers_of_files(self):
        paths, arrays = self.files(), picture()
        of_files, of_arrays = camera().convert(*paths, unit="mm"), camera().convert(*arrays, unit=0.001)
        for name in ("views", "target", "depth", "disparity", "valid", "occlusion"):
            np.testing.assert_array_equal(of_files[name], of_arrays[name], name)
        turned = [np.asfortranarray(array)[::-1][::-1] for array in arrays]
        np.testing.assert_array_equal(camera().convert(*turned, unit="mm")["raw"], of_arrays["raw"])
        metres = arrays[1].astype(np.float64) / 1000
        np.testing.assert_allclose(camera().convert(arrays[0], metres)["raw"], of_arrays["raw"], rtol=1e-5, atol=1e-7)
        # The same numbers are the same scene, whatever the camera.
        other = camera(focus_mm=410.0).convert(*arrays, unit="mm")
        self.assertEqual(other["meta"]["scene"]["id"], of_arrays["meta"]["scene"]["id"])
        self.assertNotEqual(camera().convert(arrays[0], metres)["meta"]["scene"]["id"], other["meta"]["scene"]["id"])

    def test_rays_and_kernels_agree(self):
        light, depth = np.full((*SIZE, 3), 0.5, dtype=np.float32), np.full(SIZE, 0.43, dtype=np.float32)
        psf, rays = (camera().convert(light, depth, level=level, rays_per_pixel=256) for level in ("psf", "rays"))
        self.assertLess(abs(rays["views"].mean() / psf["views"].mean() - 1), 0.01)
        noisy = [camera().convert(*picture(), unit="mm", level="rays", rays_per_pixel=2, seed=seed)["views"] for seed in (1, 1, 2)]
        np.testing.assert_array_equal(noisy[0], noisy[1])
        self.assertFalse(np.array_equal(noisy[0], noisy[2]))

    def test_a_configuration_of_folders_draws_from_them(self):
        image, depth = self.files()
        folders = {"image": os.path.dirname(image), "depth": os.path.dirname(depth), "meaning": {"unit": 0.001}}
        config = Configuration(scene={"rgbd": folders}, response={"model": "geometric", "pixels": None}, sensor={"pitch_um": 4.0})
        self.assertEqual(config.settings["scene"]["rgbd"]["pairs"], [[image, depth]])
        self.assertEqual(config.render(0)["views"].shape, (4, *SIZE, 3))

    def test_a_folder_of_lenses_is_drawn_from(self):
        with self.assertRaisesRegex(ValueError, "lens.from: .* has 0 lens files"):
            Configuration(lens={"from": self.folder, "names": []})
        library = os.path.join(HERE, "..", "..", "src", "lens", "library")
        config = Configuration(lens={"from": library, "names": [], "filter": {"f_number": [1.0, 2.5]}}, response={"model": "geometric", "pixels": None}, sensor={"pitch_um": 4.0})
        names = config.settings["lens"]["names"]
        self.assertTrue(names and all(name.startswith(library) for name in names))
        self.assertIn(config.recipe(0)["lens"]["name"], names)

    def test_kernels_are_those_of_the_program(self):
        seen = camera(width=24, height=16)
        bank = seen.psf([0.3, math.inf], (2, 1), rays=256)
        recipe = os.path.join(self.folder, "recipe.json")
        with open(recipe, "w") as file:
            json.dump(seen._recipe(Scene()), file)
        out = os.path.join(self.folder, "bank.npz")
        run(QPGEN, "psf", recipe, "--depths-m", "0.3,inf", "--fields", "2x1", "--rays", 256, "-o", out)
        with np.load(out) as program:
            for name in program.files:
                if name == "meta":
                    self.assertEqual(json.loads(bytes(program["meta"])), bank["meta"])
                else:
                    np.testing.assert_array_equal(program[name], bank[name], name)
        whole = bank["kernel"].sum(axis=(-1, -2)) + bank["beyond"]
        np.testing.assert_allclose(whole, 1.0, atol=1e-4)

    def test_what_is_no_picture_is_said(self):
        light, depth = (array.astype(np.float32) for array in picture())
        light, depth = light / 255, depth / 1000
        bad = light.copy()
        bad[2, 3, 1] = np.nan
        cases = [
            ((light, depth[1:]), {}, "array-.* with array-.*: .*24 × 15"),
            ((light[:, :, :2], depth), {}, r"image: shape is \(16, 24, 2\)"),
            ((light[0], depth[0]), {}, r"depth: shape is \(24,\)"),
            ((bad, depth), {}, "row 2|y = 2|3, 2"),
            ((light, np.full(SIZE, np.nan)), {}, "every depth is a hole"),
            ((light, depth.astype(np.uint8)), {}, "unit"),
            ((light, depth), {"unit": "feet"}, "unit is 'feet'"),
            ((light, depth), {"unit": -1}, "unit is -1"),
            ((light, depth), {"kind": "up"}, "up"),
            ((light, depth), {"kind": "disparity"}, "baseline|camera"),
            ((light, depth), {"sort": "z"}, "'sort'"),
            ((light, depth), {"level": "fast"}, "level is 'fast'"),
            ((light > 0.5, depth), {}, "image: dtype is bool"),
            ((light, None), {}, "an image and its depth"),
            ((light, "depth.npy"), {}, "two files or two arrays"),
            ((np.zeros((0, 0, 3), dtype=np.float32), np.zeros((0, 0), dtype=np.float32)), {}, "at least one pixel"),
        ]
        for arguments, words, said in cases:
            with self.subTest(said), self.assertRaisesRegex(ValueError, said):
                camera().convert(*arguments, **words)
        with self.assertRaises(OSError):
            camera().convert("none.png", "none.npy")
        for depths, fields, said in (([0.0], (1, 1), "depths_m is 0"), ([1.0], (0, 1), "fields is 0x1"), ([math.nan], (1, 1), "depths_m is NaN")):
            with self.subTest(said), self.assertRaisesRegex(ValueError, said):
                camera().psf(depths, fields, rays=256)
        with self.assertRaisesRegex(ValueError, "source is .sun.;"):
            camera().psf([1.0], (1, 1), rays=256, source="sun")

    def test_pictures_are_taken_in_turn(self):
        light, depth = picture()
        several = Pictures([light, light[::-1]], [depth, depth[::-1]], unit="mm")
        np.testing.assert_array_equal(several[3].image, light[::-1])
        self.assertEqual(len(pickle.loads(pickle.dumps(several))), 2)
        with self.assertRaisesRegex(ValueError, "as many"):
            Pictures([light], [])
        image, near = self.files()
        opened = Pictures.open(os.path.dirname(image), os.path.dirname(near), unit="mm")
        self.assertEqual((len(opened), opened[0].size), (1, SIZE[::-1]))
        self.assertTrue(isinstance(opened[0], Picture) and opened[0].is_file)
        np.save(os.path.join(self.folder, "image", "two.npy"), light)
        with self.assertRaisesRegex(ValueError, "'two'"):
            Pictures.open(os.path.dirname(image), os.path.dirname(near))


@unittest.skipIf(jax is None, "jax is not installed")
class Jax(unittest.TestCase):
    def test_its_arrays_go_in_and_results_come_out_through_dlpack(self):
        rng = np.random.default_rng(3)
        image = rng.random(SIZE + (3,), dtype=np.float32)
        depth = np.full(SIZE, 0.4, np.float32)
        view = camera(width=SIZE[1], height=SIZE[0])
        plain = view.convert(image, depth)["views"]
        other = view.convert(jax.numpy.asarray(image), jax.numpy.asarray(depth))["views"]
        np.testing.assert_array_equal(plain, other)
        out = jax.dlpack.from_dlpack(other)
        np.testing.assert_array_equal(np.asarray(out), plain)
