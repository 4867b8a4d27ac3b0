"""Samples for the eye. Matplotlib and Rerun may be missing."""

import importlib.util
import os
import tempfile
import unittest

import numpy as np
import quadpixel
from quadpixel.pictures import picture, points


def there(name):
    return importlib.util.find_spec(name) is not None


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        camera = quadpixel.Camera("wide_US20120327520A1_emb3", quadpixel.Pixel.ideal(8.0), focus_mm=500.0, width=24, height=16)
        cls.sample = camera.render(quadpixel.Scene.cards(quadpixel.card("noise", 400.0, texture_px=64)), rays_per_pixel=4)

    def test_a_flat_card_s_points_lie_in_its_plane(self):
        places, colours = points(self.sample)
        self.assertEqual((places.shape, colours.shape, colours.dtype), ((24 * 16, 3), (24 * 16, 3), np.dtype(np.uint8)))
        behind = self.sample["camera"]["intrinsics"]["pinhole_behind_vertex_m"]
        np.testing.assert_allclose(places[:, 2], 0.4 + behind, rtol=1e-4)
        # The stored left is the photographer's left, and rows go down.
        row = places.reshape(16, 24, 3)
        self.assertTrue((np.diff(row[..., 0], axis=1) > 0).all() and (np.diff(row[..., 1], axis=0) > 0).all())

    def test_srgb_ends_at_black_and_white(self):
        shown = picture(np.array([-1.0, 0.0, 2.0, 9.0], dtype=np.float32), white=2.0)
        np.testing.assert_allclose(shown, [0.0, 0.0, 1.0, 1.0], atol=1e-6)  # the rounding of float32

    @unittest.skipUnless(there("matplotlib"), "matplotlib is not installed")
    def test_a_figure_has_every_picture_and_map(self):
        import matplotlib

        matplotlib.use("Agg")
        figure = quadpixel.show(self.sample)
        titles = [axis.get_title() for axis in figure.axes if axis.get_title()]
        self.assertEqual(titles, ["sum", "view B", "view A", "view D", "view C", "all in focus", "depth, m", "x_L - x_R, px",
                                  "circle of confusion, px", "occlusion"])
        figure.canvas.draw()

    @unittest.skipUnless(there("rerun"), "rerun is not installed")
    def test_a_recording_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "sample.rrd")
            quadpixel.to_rerun(self.sample, path)
            self.assertGreater(os.path.getsize(path), 10_000)


if __name__ == "__main__":
    unittest.main()
