"""Reads a dataset and its exports as `python/test` makes them; QUADPIXEL_DATA is their folder."""

import glob
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy as np
import OpenEXR

import quadpixel

DATA = os.environ["QUADPIXEL_DATA"]
ROOT = os.path.join(DATA, "set")
EXAMPLES = os.path.join(os.path.dirname(__file__), "..", "examples")
HALF = 2.0**-11  # relative rounding of half precision
# Relative error of the median depth by the paraxial maps: their ratio and the camera's are two quadratures of one integral.
RATIO_TOLERANCE = 0.002


def srgb(v):
    v = np.clip(v, 0.0, 1.0)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 1e-12) ** (1 / 2.4) - 0.055)


# A chart has no objects and normals: those are maps of worlds of meshes.
# Camera-like pictures are on request; this dataset has none.
FOUND_ITEMS = tuple(item for item in quadpixel.ITEMS if not item.startswith("camera_"))
CHART_ITEMS = tuple(item for item in FOUND_ITEMS if item not in ("objects", "normal"))


class Hostile(unittest.TestCase):
    """Datasets that somebody else made: nothing outside of them is read, and no wrong sample is given."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.root = os.path.join(self.folder, "set")
        shutil.copytree(ROOT, self.root)
        shutil.copytree(os.path.join(self.root, "samples", "000001"), os.path.join(self.folder, "outside"))

    def change(self, name, change):
        path = os.path.join(self.root, name)
        with open(path, "rb") as file:
            text = file.read()
        with open(path, "wb") as file:
            file.write(change(text))

    def change_meta(self, change):
        """Changes a sample's description as a faulty writer would have written it."""
        def changed(text):
            meta = json.loads(text)
            change(meta)
            self.length = len(json.dumps(meta))
            return json.dumps(meta).encode()

        self.change("samples/000001/meta.json", changed)

        def listed(text):
            manifest = json.loads(text)
            for entry in manifest["files"]:
                if entry["path"] == "samples/000001/meta.json":
                    entry["bytes"] = self.length
            return json.dumps(manifest).encode()

        self.change("dataset.json", listed)

    def refused(self, why, items=FOUND_ITEMS):
        items = tuple(item for item in items if item not in ("objects", "normal"))
        with self.assertRaisesRegex(ValueError, why):
            quadpixel.Dataset(self.root, items=items)[1]

    def test_no_id_leads_out_of_the_dataset(self):
        for bad in ("../../outside", os.path.join(self.folder, "outside"), "..", "a/b", ""):
            shutil.copy(os.path.join(ROOT, "dataset.json"), self.root)
            self.change("dataset.json", lambda text: text.replace(b'"000001"', json.dumps(bad).encode()))
            self.refused("allowed")

    def test_no_link_and_no_format_leads_out_of_the_dataset(self):
        sample = os.path.join(self.root, "samples", "000001")
        shutil.rmtree(sample)
        os.symlink(os.path.join(self.folder, "outside"), sample)
        self.refused("leads out")
        os.remove(sample)
        shutil.copytree(os.path.join(self.folder, "outside"), sample)
        self.change_meta(lambda meta: meta["raw"].update(format="/../../../outside/raw.png"))
        self.refused("raw.format")

    def test_a_pipe_is_refused_and_not_waited_for(self):
        os.remove(os.path.join(self.root, "samples/000001/meta.json"))
        os.mkfifo(os.path.join(self.root, "samples/000001/meta.json"))
        self.refused("no plain file")

    def test_what_does_not_fit_together_is_refused(self):
        self.change("samples/000001/meta.json", lambda text: text.replace(b'"efl_mm": ', b'"efl_mm":', 1))
        self.refused("bytes")
        shutil.copy(os.path.join(ROOT, "samples/000001/meta.json"), os.path.join(self.root, "samples/000001"))
        self.change("samples/000001/depth.exr", lambda content: content[:-1])
        self.refused("depth.exr has")
        shutil.copy(os.path.join(ROOT, "samples/000001/depth.exr"), os.path.join(self.root, "samples/000001"))
        self.change_meta(lambda meta: meta["sensor"].update(height_px=47))
        self.refused("the sensor's is")
        self.change_meta(lambda meta: meta["channels"].extend([meta["channels"][0]] * 1_000_000))
        self.refused("channels")

    def test_no_url_of_an_index_leads_out_of_its_folder(self):
        index = os.path.join(self.folder, "train.json")
        for url in ("../x.tar", "/etc/passwd", "http://example.org/x.tar"):
            with open(index, "w") as file:
                json.dump({"shardlist": [{"url": url}]}, file)
            with self.assertRaisesRegex(ValueError, "allowed"):
                list(quadpixel.iterate_shards(index))


class Native(unittest.TestCase):
    def test_splits_are_disjoint_and_whole(self):
        parts = [quadpixel.Dataset(ROOT, split=s).ids for s in ("train", "val", "test")]
        self.assertEqual(sorted(sum(parts, [])), quadpixel.Dataset(ROOT).ids)
        self.assertEqual(len(quadpixel.Dataset(ROOT)), 6)
        with self.assertRaises(ValueError):
            quadpixel.Dataset(ROOT, items=("views", "normals"))
        with self.assertRaises(IndexError):
            quadpixel.Dataset(ROOT)[6]
        with self.assertRaisesRegex(FileNotFoundError, "objects"):
            quadpixel.Dataset(ROOT, items=("objects",))[0]

    def test_what_an_earlier_release_made_is_named_with_how_to_make_it_again(self):
        with self.assertRaisesRegex(ValueError, "earlier release.*qpgen render.*qpgen dataset"):
            quadpixel.decode({"meta.json": b'{ "schema_version": 1 }'})
        with self.assertRaisesRegex(ValueError, "schema version 99"):
            quadpixel.decode({"meta.json": b'{ "schema_version": 99 }'})

    def test_shapes_types_and_the_ties_between_files(self):
        sample = quadpixel.Dataset(ROOT, items=CHART_ITEMS)[1]
        h, w = 48, 64
        shapes = {"raw": (2 * h, 2 * w, 3), "views": (4, h, w, 3), "sum": (h, w, 3), "target": (h, w, 3), "depth": (h, w),
                  "disparity": (4, h, w, 2), "left_right": (h, w), "valid": (h, w), "noisy": (2 * h, 2 * w, 3),
                  "noisy_views": (4, h, w, 3), "shading": (4, h, w, 3), "mosaic": (2 * h, 2 * w), "noisy_mosaic": (2 * h, 2 * w)}
        for name, shape in shapes.items():
            self.assertEqual(sample[name].shape, shape, name)
        self.assertEqual((sample["views"].dtype, sample["noisy"].dtype, sample["valid"].dtype), (np.float32, np.uint16, bool))
        # raw(2x + i, 2y + j) = view_{2j+i}(x, y), to half a code and half precision.
        levels = sample["meta"]["raw"]
        step = levels["linear_at_white"] / (levels["white_level"] - levels["black_level"])
        for index in range(4):
            own = sample["raw"][index // 2 :: 2, index % 2 :: 2]
            self.assertLessEqual(np.max(np.abs(own - sample["views"][index]) - HALF * own), 0.51 * step + 1e-7)
        total = sample["views"].sum(axis=0)
        self.assertLessEqual(np.max(np.abs(total - sample["sum"]) - 2.1 * HALF * total), 1e-6)
        # The noisy codes are the noisy views.
        noise = sample["meta"]["noise"]["readout"]
        linear = ((sample["noisy"] - float(noise["black_level"])) / noise["gain_dn_per_e"] - noise["dark_e"]) / noise["electrons_at_white"]
        for index in range(4):
            own = linear[index // 2 :: 2, index % 2 :: 2]
            self.assertLessEqual(np.max(np.abs(own - sample["noisy_views"][index]) - 1.1 * HALF * np.abs(own)), 1e-7)
        # Each microlens's own colour.
        channels = quadpixel.mosaic_channels(sample["meta"])
        self.assertEqual(channels[:4, :4].tolist(), [[0, 0, 1, 1], [0, 0, 1, 1], [1, 1, 2, 2], [1, 1, 2, 2]])
        for mosaic, source in (("mosaic", "raw"), ("noisy_mosaic", "noisy")):
            picked = np.take_along_axis(sample[source], channels[..., None], axis=-1)[..., 0]
            np.testing.assert_array_equal(sample[mosaic], picked, mosaic)
        self.assertEqual(sample["noisy_mosaic"].dtype, np.uint16)
        # Light and its noisy capture agree on average.
        self.assertAlmostEqual(float(linear.mean() / sample["raw"].mean()), 1.0, delta=0.03)
        for name in ("depth", "distance", "coc", "left_right"):
            np.testing.assert_array_equal(np.isnan(sample[name]), ~sample["valid"], name)
        self.assertTrue(np.all(sample["distance"][sample["valid"]] >= sample["depth"][sample["valid"]] * (1 - 1e-6)))

    def test_signs_and_metres(self):
        for sample in quadpixel.Dataset(ROOT, items=("disparity", "depth", "coc", "valid")):
            meta, valid = sample["meta"], sample["valid"]
            focus = meta["focus"]["distance_m"]
            near = valid & (sample["depth"] < 0.9 * focus)
            far = valid & (sample["depth"] > 1.1 * focus)
            self.assertTrue(np.all(sample["coc"][near] < 0) and np.all(sample["coc"][far] > 0))
            self.assertGreater(np.median(sample["left_right"][near]) if near.any() else 1.0, 0.0)
            self.assertLess(np.median(sample["left_right"][far]) if far.any() else -1.0, 0.0)
            # SPEC.md: with the paraxial maps and the ratio at the pixel itself the depth comes back exactly.
            shift = quadpixel.left_right(sample["paraxial"], meta)
            blurred = valid & (np.abs(sample["coc"]) > 0.5)
            ratio = -shift[blurred] / sample["coc"][blurred]
            depth = quadpixel.depth_from_left_right(shift[blurred], sample["camera"], ratio)
            np.testing.assert_allclose(depth, sample["depth"][blurred], rtol=1e-4)
            # The sample's one ratio is their mean, weighted by coc squared.
            weight = sample["coc"][blurred] ** 2
            self.assertAlmostEqual(np.average(ratio, weights=weight), meta["coc_disparity"]["paraxial_ratio"], delta=0.01)

    def test_depth_of_the_traced_disparity_is_exact_to_a_thousandth(self):
        for sample in quadpixel.Dataset(ROOT, items=("disparity", "depth", "valid")):
            shift, behind = sample["left_right"], sample["camera"]["intrinsics"]["pinhole_behind_vertex_m"]
            depth = quadpixel.depth_from_disparity(shift, sample["camera"])
            known = sample["valid"] & np.isfinite(sample["depth"])
            nearness, truth = (1.0 / (z[known] + behind) for z in (depth, sample["depth"]))
            np.testing.assert_allclose(nearness, truth, rtol=1e-3)

    def test_channels_have_their_own_disparity_and_grey_lies_between(self):
        for sample in quadpixel.Dataset(ROOT, items=("disparity", "shifts", "shading", "valid")):
            valid = sample["valid"]
            red, green, blue, grey = (quadpixel.channel_disparity(sample, c) for c in ("R", "G", "B", "grey"))
            np.testing.assert_array_equal(green, sample["disparity"])
            self.assertGreater(np.abs(red - green)[:, valid].max(), 0.01)
            lateral = sample["channel_shifts"]
            # Without lateral colour grey is a mean of the three.
            flat = {c: np.concatenate([lateral[c][:-1], 0.0 * lateral[c][-1:]]) for c in "RB"}
            mean = quadpixel.channel_disparity({**sample, "channel_shifts": flat}, "grey")
            low, high = (f(np.stack([red, green, blue]), axis=0) for f in (np.min, np.max))
            self.assertTrue(np.all((mean >= low - 2e-3) & (mean <= high + 2e-3) | ~valid[None, ..., None]))
            self.assertEqual(grey.shape, green.shape)

    def test_depth_takes_its_ratio_from_the_camera_and_no_truth_is_needed(self):
        for index in range(6):
            sample = quadpixel.Dataset(ROOT, items=("disparity", "depth", "coc", "valid"))[index]
            camera, blurred = sample["camera"], sample["valid"] & (np.abs(sample["coc"]) > 0.5)
            self.assertFalse({"coc_disparity", "ranges", "scene", "seed"} & set(camera))
            shift = quadpixel.left_right(sample["paraxial"], sample["meta"])
            depth = quadpixel.depth_from_left_right(shift, camera)
            self.assertLess(np.median(np.abs(depth - sample["depth"])[blurred] / sample["depth"][blurred]), RATIO_TOLERANCE)
            with self.assertRaisesRegex(ValueError, "whole window"):
                quadpixel.depth_from_left_right(shift[:-1], camera)

    def test_ratios_between_nodes_are_bilinear_and_one_that_is_not_above_zero_gives_no_depth(self):
        plane = lambda x, y: 0.4 + 0.01 * x - 0.02 * y + 0.003 * x * y
        # Nodes on the outer edges of a window of 8 x 4 px: x from -0.5 to 7.5, y from -0.5 to 3.5.
        values = [plane(x - 0.5, y - 0.5) for y in (0, 4) for x in (0, 4, 8)]
        left_right = {"mean": 0.4, "columns": 3, "rows": 2, "values": values}
        pinhole = {"pinhole_behind_vertex_m": 0.0, "fx_px": 1000.0, "entrance_pupil_diameter_m": 0.002}
        camera = {"width_px": 8, "height_px": 4, "intrinsics": pinhole, "focus": {"distance_m": None},
                  "disparity_ratio": {"left_right": left_right, "top_bottom": None}}
        y, x = np.mgrid[:4, :8]
        np.testing.assert_allclose(quadpixel.disparity_ratio(camera), plane(x, y), rtol=1e-12)
        # z = ratio * fx * A / shift for a lens at infinity.
        np.testing.assert_allclose(quadpixel.depth_from_left_right(np.full((4, 8), 0.5), camera), plane(x, y) * 4.0, rtol=1e-12)
        self.assertTrue(np.isnan(quadpixel.depth_from_left_right(0.5, camera, 0.0)))
        self.assertEqual(quadpixel.depth_from_left_right(-0.5, camera, 0.4), np.inf)
        with self.assertRaisesRegex(ValueError, "top_bottom"):
            quadpixel.disparity_ratio(camera, "top_bottom")


class Files(unittest.TestCase):
    def test_other_readers_find_the_same_numbers(self):
        compared = 0
        for path in sorted(glob.glob(os.path.join(ROOT, "samples", "000000", "*"))):
            if path.endswith(".exr"):
                with OpenEXR.File(path, separate_channels=True) as file:
                    theirs = {name: np.array(c.pixels, dtype=np.float32) for name, c in file.channels().items()}
                ours = quadpixel.read_exr(path)
                self.assertEqual(sorted(ours), sorted(theirs))
                for name in ours:
                    np.testing.assert_array_equal(ours[name], theirs[name], path)
            elif path.endswith(".png"):
                theirs, ours = cv2.imread(path, cv2.IMREAD_UNCHANGED), quadpixel.read_png(path)
                theirs = theirs if theirs.ndim == 2 else theirs[..., ::-1]
                np.testing.assert_array_equal(ours, theirs, path)
                self.assertEqual(ours.dtype, theirs.dtype)
            else:
                continue
            compared += 1
        self.assertGreater(compared, 10)


class Layouts(unittest.TestCase):
    def test_dpdd_as_its_loaders_read_it(self):
        found = 0
        for split in ("train", "val", "test"):
            lists = [sorted(glob.glob(os.path.join(DATA, "dpdd", f"{split}_{part}", kind, "*.png")))
                     for part, kind in (("c", "source"), ("c", "target"), ("l", "source"), ("r", "source"))]
            names = [[os.path.basename(p) for p in paths] for paths in lists]
            self.assertTrue(all(n == names[0] for n in names))
            data = quadpixel.Dataset(ROOT, split=split, items=("views", "target"))
            self.assertEqual([n[:-4] for n in names[0]], data.ids)
            for sample, *paths in zip(data, *lists):
                codes = [cv2.imread(path, -1) for path in paths]
                self.assertTrue(all(c.dtype == np.uint16 and c.ndim == 3 for c in codes))
                source, target, left, right = (c[..., ::-1] / 65535 for c in codes)
                np.testing.assert_allclose(source, srgb(sample["sum"]), atol=1.5e-5)
                np.testing.assert_allclose(target, srgb(sample["target"]), atol=1.5e-5)
                halves = quadpixel.halves(sample["views"], sample["meta"])
                for picture, half in zip((left, right), halves):
                    np.testing.assert_allclose(picture, srgb(2 * half), atol=1.5e-5)
                found += 1
        self.assertEqual(found, 6)

    def test_qpdnet_as_its_loader_reads_it(self):
        found = 0
        for split in ("train", "val", "test"):
            root = os.path.join(DATA, "qpdnet")
            images = [sorted(glob.glob(os.path.join(root, f"{split}_{part}", "source", "seq_*/*.png"))) for part in "clrtb"]
            shifts = sorted(glob.glob(os.path.join(root, f"{split}_c", "target_disp", "seq_*/*.npy")))
            by_id = {sample["id"]: sample for sample in quadpixel.Dataset(ROOT, split=split)}
            for *paths, shift in zip(*images, shifts):
                disparity = np.load(shift)
                flow = np.stack([-disparity, np.zeros_like(disparity)], axis=-1)
                self.assertEqual((disparity.dtype, flow.shape), (np.float32, (48, 64, 2)))
                pictures = [cv2.imread(path, -1) for path in paths]
                self.assertTrue(all(p.dtype == np.uint8 for p in pictures))
                sample = by_id[os.path.basename(shift)[:-4]]
                usable = np.abs(flow[..., 0]) < 512
                np.testing.assert_array_equal(usable, sample["valid"])
                np.testing.assert_allclose(disparity[usable], sample["left_right"][usable], atol=1e-5)
                for side, picture in zip("LRTB", pictures[1:]):
                    (half,) = quadpixel.halves(sample["views"], sample["meta"], side)
                    np.testing.assert_allclose(picture[..., ::-1] / 255, srgb(2 * half), atol=0.51 / 255)
                found += 1
        self.assertEqual(found, 6)

    def test_webdataset_gives_the_same_samples(self):
        seen = []
        for index in sorted(glob.glob(os.path.join(DATA, "webdataset", "*.json"))):
            if os.path.basename(index) == "export.json":
                continue
            with open(index, "rb") as file:
                listed = sum(shard["nsamples"] for shard in json.load(file)["shardlist"])
            split = os.path.basename(index)[:-5]
            native = quadpixel.Dataset(ROOT, split=split, items=CHART_ITEMS)
            self.assertEqual(listed, len(native))
            for ours, theirs in zip(native, quadpixel.iterate_shards(index)):
                self.assertEqual(sorted(ours), sorted(theirs))
                for name, value in ours.items():
                    np.testing.assert_equal(theirs[name], value)
                seen.append(ours["id"])
        self.assertEqual(sorted(seen), quadpixel.Dataset(ROOT).ids)


class Examples(unittest.TestCase):
    def run_example(self, name, *arguments):
        done = subprocess.run([sys.executable, os.path.join(EXAMPLES, name), *arguments], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_training_runs_or_says_what_is_missing(self):
        text = self.run_example("train_depth.py", ROOT, "40")
        print("train_depth.py:", text.strip())
        self.assertTrue("after" in text or "torch is not installed" in text)

    @unittest.skipIf(importlib.util.find_spec("ray") is None, "ray is not installed")
    def test_ray_renders_the_bytes_of_the_dataset(self):
        with tempfile.TemporaryDirectory() as out:
            config = os.path.join(os.path.dirname(os.path.abspath(__file__)), "small.toml")
            self.run_example("on_ray.py", config, out, "2")
            for sample in ("000000", "000001"):
                ours, theirs = os.path.join(out, sample), os.path.join(ROOT, "samples", sample)
                self.assertEqual(sorted(os.listdir(ours)), sorted(os.listdir(theirs)))
                for name in os.listdir(ours):
                    with open(os.path.join(ours, name), "rb") as a, open(os.path.join(theirs, name), "rb") as b:
                        self.assertEqual(a.read(), b.read(), name)

    def test_shards_are_read(self):
        text = self.run_example("read_shards.py", os.path.join(DATA, "webdataset", "train.json"))
        self.assertIn("samples", text)


if __name__ == "__main__":
    unittest.main()
