"""Loaders and scores of scripts/benchmark-real, on folders of each layout made here."""

import sys
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from benchmark import metric, scores, sets  # noqa: E402

HEIGHT, WIDTH = 40, 56


class Layouts(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = Path(self.folder.name)
        self.rng = np.random.default_rng(1)
        self.truth = np.linspace(0.2, 0.9, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH)

    def tearDown(self):
        self.folder.cleanup()

    def write(self, name, image):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".npy":
            np.save(path, image)
        else:
            self.assertTrue(cv2.imwrite(str(path), image))

    def views(self, *names, size=(HEIGHT, WIDTH), dtype=np.uint8):
        for name in names:
            picture = self.rng.integers(0, np.iinfo(dtype).max, (*size, 3), dtype=dtype)
            self.write(name, picture)

    def only(self):
        found = list(sets.scenes(self.root))
        self.assertEqual(len(found), 1)
        scene = found[0]
        self.assertEqual(scene.size, (HEIGHT, WIDTH))
        self.assertTrue(scene.left.exists() and scene.right.exists())
        self.assertTrue(all(0 <= view.min() and view.max() <= 1.001 for view in scene.pair))
        return scene

    def test_phone(self):
        wide = (HEIGHT + 8, WIDTH + 16)
        sheet = np.full(wide, 5000, np.uint16)
        for side, gain in (("left", 2), ("right", 1)):
            self.write(f"calibration/white_sheet_{side}.png", 1024 + sheet * gain)
            self.write(f"scenes/001_{side}.png", 1024 + sheet * gain)
        codes = np.round(self.truth * 255).astype(np.uint8)
        codes[0, 0] = 0
        self.write("scenes/001_defocus.png", codes)
        scene = self.only()
        np.testing.assert_allclose(scene.pair[0], scene.pair[1], err_msg="the sheet evens the views")
        self.assertTrue(np.isnan(scene.truth[0, 0]))
        self.assertAlmostEqual(scene.truth[20, 20], codes[20, 20] / 255)
        self.assertIn(f"{WIDTH}x{HEIGHT}", scene.flags)

    def test_dp119(self):
        self.views("box/l.png", "box/r.png")
        metres = 1 / self.truth
        metres[0, 0] = 0
        self.write("box/d.png", np.round(1000 * metres).astype(np.uint16))
        scene = self.only()
        self.assertTrue(scene.is_inverse_depth and np.isnan(scene.truth[0, 0]))
        np.testing.assert_allclose(scene.truth[1:], self.truth[1:], rtol=1e-3)

    def test_metric_captures(self):
        self.views("box/l.png", "box/r.png", "flat/1500/f4/l.png", "flat/1500/f4/r.png", "flat/1500/f20/l.png")
        self.write("box/d.png", np.full((2 * HEIGHT, 2 * WIDTH), 51, np.uint8))
        plane, box = metric.captures(self.root)
        self.assertEqual((plane[0], box[0]), ("plane at 1500 mm", "box"))
        self.assertTrue(plane[1].exists() and plane[2].exists() and box[2].exists())
        np.testing.assert_allclose(plane[3], np.full((HEIGHT, WIDTH), 1.5))
        np.testing.assert_allclose(box[3], np.full((HEIGHT, WIDTH), 2.0))

    def test_dslr(self):
        self.views("0001_L.png", "0001_R.png", "0001_B.png", dtype=np.uint16)
        self.write("0001_D.tif", self.truth.astype(np.float32))
        np.testing.assert_allclose(self.only().truth, self.truth, rtol=1e-6)

    def test_quad_pixel(self):
        self.views("test_l/source/seq_1/a.png", "test_r/source/seq_1/a.png", "test_c/source/seq_1/a.png")
        shift = -4 * self.truth
        shift[3, 3] = 1000
        self.write("test_c/target_disp/seq_1/a.npy", shift)
        scene = self.only()
        self.assertTrue(np.isnan(scene.truth[3, 3]))
        self.assertAlmostEqual(scene.truth[9, 9], shift[9, 9])

    def test_without_truth(self):
        self.views("test_l/source/1P0A1.png", "test_r/source/1P0A1.png", "test_c/target/1P0A1.png", dtype=np.uint16)
        self.assertIsNone(self.only().truth)

    def test_what_is_no_set_is_named(self):
        with self.assertRaisesRegex(sets.UnknownLayout, "no pairs of a known layout"):
            list(sets.scenes(self.root))
        self.views("0001_L.png")
        with self.assertRaisesRegex(sets.UnknownLayout, "0001_R.png"):
            list(sets.scenes(self.root))
        self.views("0001_R.png", size=(HEIGHT, WIDTH + 1))
        with self.assertRaisesRegex(sets.UnknownLayout, "one size"):
            list(sets.scenes(self.root))


class Scores(unittest.TestCase):
    def test_what_is_affine_is_without_error(self):
        rng = np.random.default_rng(2)
        truth = rng.uniform(0.2, 2.0, (30, 40))
        found = scores.score(-3 * truth + 1, np.full(truth.shape, 1e-3), truth, np.ones(truth.shape, bool), is_inverse_depth=True)
        np.testing.assert_allclose(found, [0, 0, 0, 0, 0, 1, 1, 1], atol=1e-6)

    def test_errors_are_those_that_were_put_in(self):
        rng = np.random.default_rng(3)
        truth = rng.uniform(0, 1, (200, 200))
        noise = rng.normal(0, 0.02, truth.shape)
        # In units of the estimate sigma is half of what it is in the truth's.
        found = scores.score((truth + noise) / 2, np.full(truth.shape, 0.01), truth, np.ones(truth.shape, bool))
        self.assertAlmostEqual(found[0], 0.02 * np.sqrt(2 / np.pi), delta=5e-4)
        self.assertAlmostEqual(found[1], 0.02, delta=5e-4)
        self.assertAlmostEqual(found[6], 0.683, delta=0.01)
        self.assertAlmostEqual(found[7], 0.954, delta=0.01)
        self.assertTrue(np.isnan(found[3:6]).all())

    def test_errors_in_metres(self):
        truth = np.array([0.0, 1.0, 2.0, 4.0, 8.0, 30.0])
        depth = np.array([9.0, 1.1, 2.0, np.nan, 12.0, 1.0])
        sigma = np.array([1.0, 0.08, 0.1, 1.0, 1.0, 1.0])
        # Errors 0.1, 0, 6 and 2 m: 0 and beyond 10 m count nowhere, and what is not found lies at 10 m.
        found = metric.errors(depth, sigma, truth)
        np.testing.assert_allclose(found, [8.1 / 4, (0.1 + 0 + 1.5 + 0.25) / 4, 0.5, 0.25, 0.5])

    def test_a_constant_says_nothing(self):
        truth = np.linspace(0, 1, 400).reshape(20, 20)
        found = scores.score(np.zeros(truth.shape), None, truth, np.ones(truth.shape, bool))
        self.assertAlmostEqual(found[0], 0.25, delta=0.01)
        self.assertEqual(found[2], 1)
        self.assertTrue(np.isnan(found[6:]).all())


if __name__ == "__main__":
    unittest.main()
