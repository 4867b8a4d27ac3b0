"""Datasets in FiftyOne, which may be missing (it needs MongoDB, too)."""

import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import quadpixel

DATA = os.environ.get("QUADPIXEL_DATA")
THERE = importlib.util.find_spec("fiftyone") is not None


@unittest.skipUnless(THERE and DATA, "FiftyOne is not installed, or QUADPIXEL_DATA not set")
class FiftyOne(unittest.TestCase):
    def test_samples_are_groups_with_maps(self):
        import fiftyone
        from PIL import Image
        from quadpixel.fiftyone import to_fiftyone

        source = quadpixel.Dataset(os.path.join(DATA, "set"))
        with tempfile.TemporaryDirectory() as folder:
            dataset = to_fiftyone(source.root, os.path.join(folder, "new"))
            try:
                self.assertEqual(sorted(dataset.group_slices), ["sum", "target", "view-A", "view-B", "view-C", "view-D"])
                self.assertEqual(len(dataset), len(source))
                self.assertEqual(set(dataset.distinct("tags")), {e["split"] for e in source.manifest["samples"]})
                for found in dataset:
                    expected = source[source.ids.index(found["sample"])]
                    low, high = found["left_right_range"]
                    codes = np.asarray(Image.open(found["left_right"].map_path)).astype(np.float64)
                    truth = expected["left_right"]
                    known = np.isfinite(truth)
                    # Half a step of the bytes.
                    np.testing.assert_allclose((low + codes / 255 * (high - low))[known], truth[known], atol=0.51 * (high - low) / 255)
                    self.assertEqual(found["lens"], expected["meta"]["lens"]["name"])
                    self.assertEqual(np.asarray(Image.open(found.filepath)).shape, expected["sum"].shape)
            finally:
                dataset.delete()
            with self.assertRaisesRegex(ValueError, "holds files already"):
                to_fiftyone(source.root, os.path.join(folder, "new"))
        self.assertTrue(fiftyone.__version__)

    def test_a_folder_that_is_no_dataset_is_named(self):
        from quadpixel.fiftyone import Importer

        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(OSError, "dataset.json"):
            Importer(folder)


class WithoutIt(unittest.TestCase):
    def test_the_package_does_not_load_it(self):
        code = "import quadpixel, sys; assert 'fiftyone' not in sys.modules"
        subprocess.run([sys.executable, "-c", code], check=True)


if __name__ == "__main__":
    unittest.main()
