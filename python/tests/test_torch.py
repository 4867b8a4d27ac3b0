"""Samples rendered in the workers of a DataLoader. Needs PyTorch."""

import os
import signal
import time
import unittest

import numpy as np
from quadpixel import Camera, Charts, Configuration, Pictures, Pixel

try:
    import torch
    from quadpixel.torch import OnTheFly
except ImportError:
    torch = None

LENS = "wide_US20120327520A1_emb3"
SMALL = {"rays_per_pixel": 2}


def camera(focus_mm=400.0):
    return Camera(LENS, Pixel.ideal(6.0), focus_mm=focus_mm, width=12, height=8)


def charts():
    return Charts(texture_px=64, cards=1)


@unittest.skipIf(torch is None, "torch is not installed")
class Loading(unittest.TestCase):
    def epoch(self, data, workers, batch=2, **options):
        loader = torch.utils.data.DataLoader(data, batch_size=batch, num_workers=workers, **options)
        samples = {}
        for found in loader:
            for i, number in enumerate(found["index"].tolist()):
                samples[number] = found["views"][i].numpy().copy()
        return samples

    def same(self, a, b):
        self.assertEqual(sorted(a), sorted(b))
        for number in a:
            np.testing.assert_array_equal(a[number], b[number])

    def test_workers_render_the_same_samples_each_once(self):
        data = OnTheFly(charts(), camera(), seed=5, length=6, **SMALL)
        alone = self.epoch(data, 0)
        self.assertEqual(sorted(alone), list(range(6)))
        self.assertEqual(len({picture.tobytes() for picture in alone.values()}), 6)
        self.same(alone, self.epoch(data, 2))  # forked after this process's threads were made
        self.same(alone, self.epoch(data, 2, multiprocessing_context="spawn"))
        data.set_epoch(1)
        later = self.epoch(data, 2)
        self.assertEqual(sorted(later), list(range(6, 12)))
        self.same({7: later[7]}, {7: data.sample(7)["views"]})
        self.assertFalse(np.array_equal(self.epoch(OnTheFly(charts(), camera(), seed=6, length=1, **SMALL), 0)[0], alone[0]))

    def test_an_epoch_goes_on_where_it_was_left(self):
        data = OnTheFly(charts(), camera(), seed=5, length=8, **SMALL)
        whole = self.epoch(data, 2)
        again = OnTheFly(charts(), camera(), seed=5, length=8, **SMALL)
        again.load_state_dict(data.state_dict(taken=4))
        self.same({number: whole[number] for number in range(4, 8)}, self.epoch(again, 2))
        with self.assertRaisesRegex(ValueError, "seed and length"):
            OnTheFly(charts(), camera(), seed=6, length=8).load_state_dict(data.state_dict())

    def test_cameras_are_drawn(self):
        several = OnTheFly(charts(), [camera(300.0), camera(500.0)], length=8, **SMALL)
        focus = [several.sample(i)["meta"]["focus"]["distance_m"] for i in range(8)]
        self.assertEqual(set(np.round(focus, 3)), {0.3, 0.5})
        drawn = OnTheFly(charts(), draw_camera, length=2, items=("depth",), **SMALL)
        self.assertNotEqual(*(drawn.sample(i)["meta"]["focus"]["distance_m"] for i in range(2)))
        self.assertEqual(next(iter(drawn))["depth"].shape, (8, 12))

    def test_pictures_with_depth_are_converted(self):
        rng = np.random.default_rng(1)
        lights = [rng.random((16, 24, 3), dtype=np.float32) for _ in range(3)]
        pictures = Pictures(lights, [np.full((16, 24), 0.39 + 0.01 * i, dtype=np.float32) for i in range(3)])
        data = OnTheFly(pictures, camera(), length=6)
        alone = self.epoch(data, 0)
        self.same(alone, self.epoch(data, 2))
        np.testing.assert_array_equal(alone[4], alone[1])
        np.testing.assert_array_equal(alone[1], camera().convert(pictures[1])["views"])
        rays = OnTheFly(pictures, camera(), length=6, level="rays", rays_per_pixel=2)
        self.assertFalse(np.array_equal(rays.sample(4)["views"], rays.sample(1)["views"]))

    def test_a_configuration_draws_everything(self):
        file = os.path.join(os.path.dirname(os.path.abspath(__file__)), "small.toml")
        config = Configuration.open(file)
        data = OnTheFly(config, seed=config.seed, length=1, transform=lambda sample: sample["views"])
        (views,) = data
        np.testing.assert_array_equal(views, config.render(0)["views"])

    def test_a_worker_that_is_killed_is_an_error_and_no_hang(self):
        data = OnTheFly(charts(), camera(), length=1000, **SMALL)
        loader = iter(torch.utils.data.DataLoader(data, num_workers=2))
        next(loader)
        os.kill(loader._workers[0].pid, signal.SIGKILL)
        began = time.monotonic()
        with self.assertRaises(RuntimeError):
            for _ in loader:
                self.assertLess(time.monotonic() - began, 60.0)

    def test_an_error_in_a_worker_keeps_its_words(self):
        data = OnTheFly(Charts(cards=1000), camera(), length=4)
        with self.assertRaisesRegex(ValueError, "scene.cards"):
            self.epoch(data, 1)

    def test_what_cannot_be_is_named(self):
        for call, text in (
            (lambda: OnTheFly(charts()), "cameras"),
            (lambda: OnTheFly(charts(), []), "cameras"),
            (lambda: OnTheFly(charts(), camera(), length=0), "length"),
            (lambda: OnTheFly(charts(), camera(), rays=3), "rays"),
            (lambda: OnTheFly(charts(), camera()).set_epoch(-1), "epoch"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                call()


def draw_camera(generator):
    return camera(float(generator.uniform(300.0, 500.0)))


if __name__ == "__main__":
    unittest.main()
