"""The algorithms from Python: the numbers of the command line, and what they say of bad input."""

import glob
import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import quadpixel

QPALGO = os.path.join(os.path.dirname(os.path.abspath(os.environ["QPGEN"])), "qpalgo")


def run(*command):
    done = subprocess.run([QPALGO, *map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def picture(file):
    channels = quadpixel.read_exr(file)
    return np.stack([channels[c] for c in "RGB"], axis=-1)


def contents(folder):
    files = {}
    for name in os.listdir(folder):
        with open(os.path.join(folder, name), "rb") as file:
            files[name] = file.read()
    return files


class SameNumbers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        camera = quadpixel.Camera("wide_US20120327520A1_emb3", quadpixel.Pixel.ideal(2.0), focus_mm=300.0, width=128, height=96)
        # Nearer than the focus, so that the views differ.
        scene = quadpixel.Scene.cards(quadpixel.card("alphabet", 290.0, texture_px=512))
        cls.folder = os.path.join(folder.name, "sample")
        camera.render(scene, rays_per_pixel=256).write(cls.folder)
        cls.sample = quadpixel.decode(contents(cls.folder), ("raw", "target", "depth", "valid"))
        cls.views = quadpixel.views(cls.sample["raw"])

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = os.path.join(folder.name, "out")

    def test_views(self):
        run("sai", self.folder, "--out", self.out)
        for index, name in enumerate("BADC"):
            theirs = picture(os.path.join(self.out, f"view_{name}.exr"))
            np.testing.assert_allclose(self.views[index], theirs, rtol=2e-7)

    def test_disparity(self):
        run("disparity", self.folder, "--out", self.out, "--format", "npy", "--window", 11, "--stride", 3)
        (file,) = glob.glob(os.path.join(self.out, "*.npy"))
        theirs = np.load(file)  # a map per view and channel
        # The command's own views: where two minima are alike, the last bit of a pixel decides which is found.
        views = self.out + "-views"
        run("sai", self.folder, "--out", views)
        total = picture(os.path.join(views, "sum_all.exr"))
        for view, name in enumerate("BADC"):
            own = picture(os.path.join(views, f"view_{name}.exr"))
            found = quadpixel.disparity(own, total, window=11, stride=3)
            for channel in range(3):
                dx, dy, sigma, verdict = np.moveaxis(theirs[3 * view + channel], -1, 0)
                np.testing.assert_array_equal(found.dx[..., channel], dx)
                np.testing.assert_array_equal(found.dy[..., channel], dy)
                np.testing.assert_array_equal(found.sigma[..., channel], sigma)
                np.testing.assert_array_equal(found.verdict[..., channel], verdict)
        self.assertEqual((found.x[0], found.x[1] - found.x[0]), (9, 3))

    def test_dense_disparity(self):
        halves = self.out + "-halves"
        run("sai", self.folder, "--out", halves)
        pair = [os.path.join(halves, f"sum_{side}.exr") for side in "LR"]
        halves = [quadpixel.read_exr(file) for file in pair]
        left, right = (half["G"] for half in halves)
        picture = np.stack([halves[0][c] + halves[1][c] for c in "RGB"], axis=-1)
        for flag, settings in (("--dense", {}), ("--network", {"network": True})):
            run("disparity", *pair, flag, "--out", self.out, "--format", "npy")
            theirs = np.load(os.path.join(self.out, "disparity.npy"))
            shift, sigma = quadpixel.dense_disparity(left, right, picture=picture, **settings)
            np.testing.assert_array_equal(shift, theirs[..., 0])
            np.testing.assert_array_equal(sigma, theirs[..., 1])
            self.assertGreater(np.median(shift), 0.1)
        everywhere = quadpixel.dense_disparity(left, right, 0.25)
        at_each = quadpixel.dense_disparity(left, right, np.full(left.shape, 0.25))
        np.testing.assert_allclose(at_each[0], everywhere[0], atol=0.02)
        falling = quadpixel.dense_disparity(left, right, np.linspace(0.3, 0.1, left.size).reshape(left.shape))
        self.assertGreater(np.abs(falling[0] - everywhere[0]).max(), 0.02)

    def test_depth(self):
        # The command's own views: the last bit of a pixel may move a path's sums, and with them the confidence.
        folder = self.out + "-views"
        run("sai", self.folder, "--out", folder)
        views = np.stack([picture(os.path.join(folder, f"view_{name}.exr")) for name in "BADC"])
        np.testing.assert_allclose(views, self.views, rtol=1e-3, atol=1e-5)
        for flags, settings, least in (
            ([], {}, 0.9),
            (["--network"], {"network": True}, 0.9),
            (["--sparse", "--window", 11], {"sparse": True, "window": 11}, 0.1),
        ):
            run("depth", self.folder, "--out", self.out, "--format", "npy", *flags)
            depth, maps = quadpixel.depth(views, self.sample["camera"], **settings)
            theirs = np.load(os.path.join(self.out, "depth.npy"))
            np.testing.assert_array_equal(np.isnan(depth), np.isnan(theirs))
            self.assertGreater(np.isfinite(depth).mean(), least)
            np.testing.assert_allclose(depth, theirs, rtol=1e-4)
            confidence = np.load(os.path.join(self.out, "confidence.npy"))
            np.testing.assert_allclose(maps["confidence"], confidence[..., 0], atol=1e-4)

    def test_refocus(self):
        file = self.out + ".exr"
        run("refocus", self.folder, "--disparity", 0.7, "--out", file)
        picture, valid = quadpixel.refocus(self.views, 0.7)
        channels = quadpixel.read_exr(file)
        np.testing.assert_allclose(picture, np.stack([channels[c] for c in "RGB"], axis=-1), rtol=1e-5, atol=1e-6)
        self.assertTrue(valid[48, 64] and not valid[0, 0])

    def test_sharpness(self):
        file = os.path.join(self.folder, "target.exr")
        rows = json.loads(run("sharpness", file, "--json"))["images"]
        self.assertEqual(len(rows), 3)
        for ours, theirs in zip(quadpixel.sharpness(self.sample["target"]), rows):
            self.assertEqual(ours, {name: theirs[name] for name in ours})

    def test_correction(self):
        file = self.out + ".json"
        run("correct-aberrations", "--calibration", self.folder, "--align", "texture", "--out", file)
        camera = self.sample["camera"]
        calibration = quadpixel.calibrate(self.views, camera, align="texture")
        with open(file) as text:
            theirs = json.load(text)
        self.assertEqual(calibration["camera"], theirs["camera"])
        for ours, other in zip(calibration["fields"], theirs["fields"]):
            np.testing.assert_allclose(ours["coefficients_px"], other["coefficients_px"], atol=1e-5)
        run("correct-aberrations", "--apply", file, self.folder, "--out", self.out)
        corrected, total, valid = quadpixel.correct_aberrations(self.views, camera, theirs)
        channels = quadpixel.read_exr(os.path.join(self.out, "corrected.exr"))
        np.testing.assert_allclose(total, np.stack([channels[c] for c in "RGB"], axis=-1), rtol=1e-5, atol=1e-5)
        self.assertEqual((corrected.shape, valid.shape), ((4, 96, 128, 3), (96, 128)))
        # A calibration of another camera is refused in the command line's words.
        theirs["camera"]["pitch_um"] = 3.0
        with self.assertRaisesRegex(ValueError, "another camera: pitch_um 3 instead of 2"):
            quadpixel.correct_aberrations(self.views, camera, theirs)


class Arrays(unittest.TestCase):
    def test_layout_and_precision_of_the_memory_change_nothing(self):
        picture = np.random.default_rng(1).random((40, 60, 3), dtype=np.float32)
        wanted = quadpixel.sharpness(picture)
        strided = np.zeros((80, 60, 3), dtype=np.float32)[::2]
        strided[...] = picture
        locked = picture.copy()
        locked.flags.writeable = False
        for same in (np.asfortranarray(picture), strided, locked, picture.astype(np.float64), picture[::-1][::-1], picture.astype(">f4")):
            self.assertEqual(quadpixel.sharpness(same), wanted)
        before = picture.copy()
        quadpixel.refocus(np.stack([picture] * 4), 0.5)
        np.testing.assert_array_equal(picture, before)

    def test_other_libraries_arrays_are_taken(self):
        class Protocol:
            def __init__(self, array):
                self.array = array

            def __dlpack__(self, **options):
                return self.array.__dlpack__(**options)

            def __dlpack_device__(self):
                return self.array.__dlpack_device__()

        picture = np.random.default_rng(1).random((40, 60), dtype=np.float32)
        self.assertEqual(quadpixel.sharpness(Protocol(picture)), quadpixel.sharpness(picture))
        try:
            import torch
        except ImportError:
            return
        self.assertEqual(quadpixel.sharpness(torch.from_numpy(picture)), quadpixel.sharpness(picture))

    def test_what_is_no_picture_is_refused(self):
        good = np.ones((4, 40, 40, 3), dtype=np.float32)
        spoilt = good.copy()
        spoilt[1, 2, 3, 0] = np.nan
        camera = {"width_px": 40}
        for call, text in (
            (lambda: quadpixel.refocus(good.astype(np.uint8), 0.0), "views: dtype is uint8"),
            (lambda: quadpixel.refocus(good.astype(bool), 0.0), "dtype is bool"),
            (lambda: quadpixel.refocus(good.astype(complex), 0.0), "dtype is complex128"),
            (lambda: quadpixel.refocus("views", 0.0), "dtype"),
            (lambda: quadpixel.refocus(good[0, 0], 0.0), "3 or 4 dimensions"),
            (lambda: quadpixel.refocus(good[:3], 0.0), "2x2 sub-pixels need"),
            (lambda: quadpixel.refocus(good[:, :0], 0.0), "at least one element"),
            (lambda: quadpixel.refocus(spoilt, 0.0), r"element \(1, 2, 3, 0\) is nan"),
            (lambda: quadpixel.refocus(good, float("inf")), "-40 to 40"),
            (lambda: quadpixel.refocus(good, 0.0, weights=[1.0]), "1 given"),
            (lambda: quadpixel.refocus(good, 0.0, lobes=5), "lobes"),
            (lambda: quadpixel.refocus(good, 0.0, subpixels="0x2"), "sub"),
            (lambda: quadpixel.views(good[0, :39, :39]), "39"),
            (lambda: quadpixel.disparity(good[0], good[0, :20]), "shape"),
            (lambda: quadpixel.disparity(good[0], good[0], window=4), "window"),
            (lambda: quadpixel.disparity(good[0], good[0], stride=-1), "stride"),
            (lambda: quadpixel.disparity(good[0], good[0], axis="up"), "axis"),
            (lambda: quadpixel.disparity(good[0, :8, :8], good[0, :8, :8]), "8"),
            (lambda: quadpixel.dense_disparity(good[0], good[0]), "dimensions"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, :20, :, 0]), "size|40"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], ratio=2.0), "ratio"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], picture=good[0, :20]), "the picture has"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], np.full((3, 4), 0.2)), "4 × 3"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], network=""), "network"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], network=__file__), "zip"),
            (lambda: quadpixel.dense_disparity(good[0, ..., 0], good[0, ..., 0], 2.0, network=True), "ratio"),
            (lambda: quadpixel.depth(good, camera, sparse=True, network=True), "sparse"),
            (lambda: quadpixel.depth(good, camera), "camera"),
            (lambda: quadpixel.calibrate(good, camera), "camera"),
            (lambda: quadpixel.sharpness(good[0], preset="best"), "preset"),
        ):
            with self.assertRaisesRegex(ValueError, text, msg=text):
                call()


if __name__ == "__main__":
    unittest.main()
