"""The commands `qpgen` and `qpalgo` of the wheel are the programs: the same words, exit codes, bytes and Ctrl-C."""

import functools
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

QPGEN = os.environ["QPGEN"]
CONFIG = pathlib.Path(__file__).with_name("small.toml").resolve()


def command(name, *args):
    """As the script that pip writes for an entry of [project.scripts]."""
    run = f"import sys; from quadpixel_programs import {name}; sys.argv[0] = {name!r}; sys.exit({name}())"
    return [sys.executable, "-c", run, *args]


def files(folder):
    folder = pathlib.Path(folder)
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


class Programs(unittest.TestCase):
    def test_words_and_exit_codes_are_those_of_the_programs(self):
        for program in (QPGEN, str(pathlib.Path(QPGEN).with_name("qpalgo"))):
            name = pathlib.Path(program).name
            for args, code in ((["--version"], 0), (["--help"], 0), (["no-such-command"], 2), ([], 2)):
                native = subprocess.run([program, *args], capture_output=True)
                wheel = subprocess.run(command(name, *args), capture_output=True)
                self.assertEqual((wheel.returncode, wheel.stdout, wheel.stderr), (code, native.stdout, native.stderr))
                self.assertEqual(native.returncode, code)

    def test_a_dataset_has_the_same_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            native, wheel = f"{folder}/native", f"{folder}/wheel"
            for made, to in (([QPGEN], native), (command("qpgen"), wheel)):
                subprocess.run([*made, "dataset", "--config", CONFIG, "--count", "2", "-q", "--out", to], check=True, stdout=subprocess.DEVNULL)
            self.assertEqual(files(native), files(wheel))

    def test_a_closed_pipe_ends_it_without_a_word(self):
        for made in ([QPGEN], command("qpgen")):
            reader, writer = os.pipe()
            os.close(reader)
            ended = subprocess.run([*made, "dataset", "--print-config"], stdout=writer, stderr=subprocess.PIPE)
            os.close(writer)
            self.assertEqual((ended.returncode, ended.stderr), (128 + signal.SIGPIPE, b""))

    def test_ctrl_c_ends_a_dataset_after_the_sample_in_hand(self):
        with tempfile.TemporaryDirectory() as folder:
            args = ("dataset", "--config", str(CONFIG), "--count", "100000", "--out", f"{folder}/out")
            run = subprocess.Popen(command("qpgen", *args), stderr=subprocess.PIPE)
            while not list(pathlib.Path(folder).glob("out/samples/*")):
                self.assertIsNone(run.poll())
                time.sleep(0.05)
            run.send_signal(signal.SIGINT)
            _, said = run.communicate(timeout=60)
            self.assertEqual(run.returncode, 1, said)
            self.assertNotIn(b"Traceback", said)
            self.assertEqual(list(pathlib.Path(folder).glob("out/samples/*tmp*")), [])

    def test_ctrl_c_ends_what_does_not_listen_at_once(self):
        with tempfile.TemporaryDirectory() as folder:
            args = command("qpgen", "accuracy", "rays", "--out", f"{folder}/out")
            # A shell that began the tests in the background has them ignore the signal, and what they start.
            heeds = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
            run = subprocess.Popen(args, stderr=subprocess.PIPE, preexec_fn=heeds)
            time.sleep(1.0)
            self.assertIsNone(run.poll())
            run.send_signal(signal.SIGINT)
            _, said = run.communicate(timeout=20)
            self.assertEqual(run.returncode, -signal.SIGINT, said)
            self.assertNotIn(b"Traceback", said)


if __name__ == "__main__":
    unittest.main()
