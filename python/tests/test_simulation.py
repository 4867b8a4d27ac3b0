"""Rendering and drawing from Python: the same bytes as the command line, and calls that behave."""

import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import quadpixel
from quadpixel import Camera, Charts, Configuration, Lens, Pixel, Scene, Worlds, card
from quadpixel.algorithms import views

LENS = "wide_US20120327520A1_emb3"
QPGEN = os.path.abspath(os.environ["QPGEN"])


def toml(value):
    """A value as TOML, on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def contents(folder):
    files = {}
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), "rb") as file:
            files[name] = file.read()
    return files


def camera(**changes):
    return Camera(LENS, Pixel.ideal(4.0), focus_mm=400.0, **{"width": 24, "height": 16, **changes})


class SameBytes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def dataset(self, settings):
        file = os.path.join(self.folder, "config.toml")
        with open(file, "w") as out:
            out.writelines(f"{name} = {toml(value)}\n" for name, value in settings.items())
        run(QPGEN, "dataset", "--config", file, "--out", os.path.join(self.folder, "set"))
        return os.path.join(self.folder, "set")

    def same(self, sample, folder):
        own = os.path.join(self.folder, f"own-{sample['id']}")
        sample.write(own)
        ours, theirs = contents(own), contents(folder)
        self.assertEqual(sorted(ours), sorted(theirs))
        for name in ours:
            self.assertEqual(ours[name], theirs[name], name)

    def test_drawn_charts_are_the_samples_of_a_dataset(self):
        seen = camera(width=20, height=12, mosaic="rggb", readout={"photons_um2": 4000})
        charts = Charts(seed=5, texture_px=64)
        root = self.dataset(seen.configuration(charts[1], rays_per_pixel=6, exposure_ev=-0.5))
        for index in range(2):
            sample = seen.render(charts[index], rays_per_pixel=6, exposure_ev=-0.5)
            self.same(sample, os.path.join(root, "samples", sample["id"]))
            self.as_it_is_read(sample, os.path.join(root, "samples", sample["id"]))

    def as_it_is_read(self, sample, folder):
        read = quadpixel.decode(contents(folder))
        for name, value in read.items():
            own = sample[name]
            if name in ("views", "sum", "target", "shading", "noisy_views", "noisy_sum", "shifts", "channel_shifts"):  # stored as half floats
                for part in (["R", "B"] if name == "channel_shifts" else [...]):
                    np.testing.assert_allclose(own[part], value[part], rtol=1e-3, atol=1e-3, err_msg=name)
            elif name in ("raw", "mosaic"):  # 16 bits
                white = sample["meta"]["raw"]["linear_at_white"]
                np.testing.assert_allclose(own, value, atol=0.51 * white / 65535, err_msg=name)
            elif name == "occlusion":  # 8 bits
                np.testing.assert_allclose(own, value, atol=0.51 / 255, err_msg=name)
            elif isinstance(value, np.ndarray):
                np.testing.assert_array_equal(own, value, name)
                self.assertEqual(own.dtype, value.dtype, name)
            elif name == "meta":
                self.assertEqual(own, {**value, "contents": own["contents"]})
            else:
                self.assertEqual(own, value)
        self.assertEqual(sorted(read), sorted(sample))

    def test_drawn_worlds_are_the_samples_of_a_dataset(self):
        seen, worlds = camera(width=12, height=8), Worlds(seed=2, kinds=["table-top"], objects=5)
        root = self.dataset(seen.configuration(worlds[0], rays_per_pixel=4))
        sample = seen.render(worlds[0], rays_per_pixel=4)
        self.assertEqual(sample["objects"].dtype, np.uint16)
        self.same(sample, os.path.join(root, "samples", "000000"))

    def test_a_configuration_renders_its_samples(self):
        file = os.path.join(os.path.dirname(os.path.abspath(__file__)), "small.toml")
        root = os.path.join(os.environ["QUADPIXEL_DATA"], "set")
        config = Configuration.open(file)
        self.assertEqual((len(config), config.seed), (6, 3))
        for index in (0, 5):
            self.same(config.render(index), os.path.join(root, "samples", f"{index:06}"))

    def test_a_scene_is_that_of_a_recipe(self):
        scene = Scene.cards(card("noise", 500.0, texture_px=64, tilt_x_deg=5.0), environment=(0.1, 0.2, 0.3))
        sample = camera().render(scene, rays_per_pixel=4, seed=9)
        recipe = os.path.join(self.folder, "recipe.json")
        with open(recipe, "w") as file:
            json.dump(sample["meta"]["scene"]["parameters"], file)
        run(QPGEN, "render", recipe, "--out", os.path.join(self.folder, "render"))
        self.same(sample, os.path.join(self.folder, "render"))

    def test_threads_change_no_bit(self):
        scenes = Charts(seed=1, texture_px=64)
        pictures = []
        for threads in (1, 3, 0):
            quadpixel.set_threads(threads)
            pictures.append(camera().render(scenes[0], rays_per_pixel=8)["raw"].tobytes())
        self.assertEqual(len(set(pictures)), 1)


class Truth(unittest.TestCase):
    def test_depth_gives_the_truth_that_a_sample_has(self):
        seen = camera()
        scene = Scene.cards(card("noise", 300.0, texture_px=64))
        sample = Camera(LENS, Pixel.ideal(4.0), focus_mm=400.0, width=24, height=16, effects="all").render(scene, rays_per_pixel=4)
        truth = seen.truth(sample["depth"])
        for name in ("disparity", "paraxial", "left_right", "coc"):
            # A sample's disparities are multiples of 2^-12 px.
            np.testing.assert_allclose(truth[name], sample[name], atol=1.01 * 2.0**-12, err_msg=name)

    def test_no_depth_gives_no_truth_and_the_sky_has_one(self):
        seen = camera()
        depth = np.full((16, 24), np.inf, dtype=np.float32)
        depth[3, 5] = np.nan
        truth = seen.truth(depth)
        self.assertTrue(np.isnan(truth["coc"][3, 5]) and np.isnan(truth["disparity"][:, 3, 5]).all())
        self.assertEqual(np.isnan(truth["left_right"]).sum(), 1)


class Calls(unittest.TestCase):
    def test_progress_is_heard_in_the_calling_thread_and_may_stop_the_work(self):
        heard = []

        def hear(done, total):
            heard.append((done, total, threading.get_ident()))

        scene = Charts(texture_px=64)[0]
        camera(width=64, height=64).render(scene, rays_per_pixel=64, progress=hear)
        done, total, _ = zip(*heard)
        self.assertEqual(done[-1], total[-1])
        self.assertEqual(list(done), sorted(done))
        self.assertEqual({thread for *_, thread in heard}, {threading.get_ident()})

        def refuse(done, total):
            raise LookupError("enough")

        began = time.monotonic()
        with self.assertRaisesRegex(LookupError, "enough"):
            camera(width=128, height=128).render(scene, rays_per_pixel=1 << 14, progress=refuse)
        self.assertLess(time.monotonic() - began, 20.0)

    def test_ctrl_c_stops(self):
        program = (
            "import sys, quadpixel as q\n"
            f"camera = q.Camera({LENS!r}, q.Pixel.ideal(4.0), focus_mm=400.0, width=128, height=128)\n"
            "print('begins', flush=True)\n"
            "try: camera.render(q.Charts(texture_px=64)[0], rays_per_pixel=1 << 16)\n"
            "except KeyboardInterrupt: print('stopped')\n"
        )
        # A shell's background jobs ignore Ctrl-C, and so would the program started from one.
        job = subprocess.Popen(
            [sys.executable, "-c", program],
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        self.addCleanup(job.kill)
        self.assertEqual(job.stdout.readline().strip(), "begins")
        time.sleep(2.0)
        job.send_signal(signal.SIGINT)
        began = time.monotonic()
        self.assertEqual(job.communicate(timeout=30)[0].strip(), "stopped")
        self.assertLess(time.monotonic() - began, 10.0)

    def test_other_threads_run_meanwhile(self):
        counted, ended = [0], threading.Event()

        def count():
            while not ended.is_set():
                counted[0] += 1
                time.sleep(0.001)

        beside = threading.Thread(target=count)
        beside.start()
        camera(width=64, height=64).render(Charts(texture_px=64)[0], rays_per_pixel=128)
        ended.set()
        beside.join()
        self.assertGreater(counted[0], 20)

    def test_a_process_forked_after_threads_renders_too(self):
        scene = Charts(texture_px=64)[0]
        own = views(camera().render(scene, rays_per_pixel=4)["raw"])
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                os.write(writer, views(camera().render(scene, rays_per_pixel=4)["raw"]).tobytes()[:4096])
            finally:
                os._exit(0)
        os.close(writer)
        with os.fdopen(reader, "rb") as file:
            self.assertEqual(file.read(), own.tobytes()[:4096])
        os.waitpid(child, 0)

    def test_cameras_and_samples_go_through_pickle(self):
        scene = Charts(texture_px=64)[0]
        sample = camera().render(scene, rays_per_pixel=4)
        again = pickle.loads(pickle.dumps(camera())).render(scene, rays_per_pixel=4)
        np.testing.assert_array_equal(again["raw"], sample["raw"])
        unpickled = pickle.loads(pickle.dumps(sample))
        np.testing.assert_array_equal(unpickled["raw"], sample["raw"])
        with self.assertRaisesRegex(ValueError, "another process"):
            unpickled.write("nowhere")


class BadInput(unittest.TestCase):
    def test_errors_have_the_command_line_s_words(self):
        for call, command in (
            (lambda: Lens.builtin("nothing"), ("lens", "info", "nothing")),
            (lambda: Pixel.builtin("nothing"), ("response", "--pixel", "nothing", "--theta-deg", "0")),
            (lambda: Lens.builtin(LENS).info(f_number=0.1), ("lens", "info", LENS, "--f-number", "0.1")),
        ):
            with self.assertRaises(ValueError) as raised:
                call()
            done = subprocess.run([QPGEN, *command], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(str(raised.exception), done.stderr)

    def test_files_that_are_not_there_are_os_errors(self):
        for opened in (Lens.open, Pixel.open, Configuration.open, Scene.open, quadpixel.read_exr):
            with self.assertRaises(FileNotFoundError):
                opened("/nowhere/a.json")
        sample = camera().render(Charts(texture_px=64)[0], rays_per_pixel=1)
        with self.assertRaises(OSError):
            sample.write("/proc/nothing/here")
        with self.assertRaisesRegex(ValueError, "already"):
            sample.write("/tmp")

    def test_files_that_are_none_are_value_errors(self):
        with tempfile.TemporaryDirectory() as folder:
            for opened, ending in ((Lens.open, "json"), (Lens.open, "zmx"), (Pixel.open, "toml"), (Configuration.open, "toml")):
                path = os.path.join(folder, f"a.{ending}")
                with open(path, "w") as file:
                    file.write("no such thing [")
                with self.assertRaises(ValueError, msg=ending):
                    opened(path)
        for read in (quadpixel.read_exr, quadpixel.read_png):
            with self.assertRaises(ValueError):
                read(b"nothing")

    def test_numbers_that_cannot_be_are_named(self):
        scene = Charts(texture_px=64)[0]
        for call, text in (
            (lambda: Camera(LENS, Pixel.ideal(4.0), focus_mm=-1.0), "-1"),
            (lambda: camera(width=0).render(scene), "sensor.width"),
            (lambda: camera().render(scene, rays_per_pixel=0), "rays_per_pixel"),
            (lambda: camera().render(scene, exposure_ev=float("nan")), "exposure_ev|NaN|expected"),
            (lambda: camera(microlens_shift="nowhere").render(scene), "nowhere"),
            (lambda: camera(colour=3), "colour"),
            (lambda: Pixel.builtin("2.8um").response("magic"), "magic"),
            (lambda: Pixel.ideal(2.8).response("wave"), "wave"),
            (lambda: Pixel.ideal(2.8, focal_length_um=7.0).response()(90.0), "theta_deg"),
            (lambda: Camera(LENS, Pixel.ideal(4.0)).render(scene), "focus_mm"),
            (lambda: camera().render(Charts(cards=1000)[0]), "scene.cards"),
            (lambda: camera().render(Charts(colour=1)[0]), "colour"),
            (lambda: camera().render(Scene.cards(card("nothing", 500.0))), "nothing"),
            (lambda: camera().render(Scene.cards()), "planes"),
            (lambda: Configuration(rays_per_pixel=0), "rays_per_pixel"),
            (lambda: quadpixel.set_threads(-1), "threads"),
            (lambda: quadpixel.set_threads(1 << 40), "threads"),
        ):
            with self.assertRaisesRegex(ValueError, text, msg=text):
                call()

    def test_depth_maps_that_cannot_be_are_named(self):
        for depth, text in (
            (np.ones((3, 4), dtype=np.float32), "shape"),
            (np.ones((16, 24, 1), dtype=np.float32), "dimensions"),
            (np.ones((16, 24), dtype=np.uint16), "dtype"),
            (np.zeros((16, 24), dtype=np.float32), "above 0"),
            ([["a"]], "dtype"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                camera().truth(depth)


if __name__ == "__main__":
    unittest.main()
