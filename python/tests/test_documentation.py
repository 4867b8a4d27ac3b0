"""The examples of the docstrings and of the documents, run."""

import doctest
import importlib
import os
import re
import unittest

import numpy as np
import quadpixel

HERE = os.path.dirname(os.path.abspath(__file__))
MODULES = ("lens", "pixel", "scene", "camera", "configuration", "algorithms", "pictures", "rendering", "rgbd")


def load_tests(loader, tests, pattern):
    for name in MODULES:
        known = {**vars(quadpixel), "np": np, "quadpixel": quadpixel}
        tests.addTests(doctest.DocTestSuite(importlib.import_module(f"quadpixel.{name}"), extraglobs=known))
    return tests


def python_blocks(name):
    """The Python blocks of a document of the repository, in order."""
    with open(os.path.join(HERE, "..", "..", *name.split("/")), encoding="utf8") as file:
        return re.findall(r"```python\n(.*?)```", file.read(), re.S)


class Documents(unittest.TestCase):
    def test_what_the_readme_shows_runs(self):
        (block,) = python_blocks("README.md")
        known = {}
        exec(block, known)
        self.assertEqual((known["sample"]["views"].shape, known["sample"]["left_right"].shape), ((4, 64, 96, 3), (64, 96)))

    def test_what_the_guide_shows_of_cameras_and_algorithms_runs(self):
        blocks = [block for block in python_blocks("docs/guide/python.md") if "qp." in block and "OnTheFly" not in block]
        self.assertEqual(len(blocks), 2)
        known = {}
        for block in blocks:
            exec(block.replace("width=256, height=192", "width=96, height=64"), known)
        self.assertEqual(known["shift"].shape, (64, 96))
        self.assertEqual(known["sharp"].shape, (64, 96, 3))
