"""The examples of the docstrings and of the documents, run."""

import doctest
import importlib
import os
import re
import unittest

import numpy as np
import quadpixel

HERE = os.path.dirname(os.path.abspath(__file__))
MODULES = ("lens", "pixel", "scene", "camera", "configuration", "algorithms")


def load_tests(loader, tests, pattern):
    for name in MODULES:
        known = {**vars(quadpixel), "np": np, "quadpixel": quadpixel}
        tests.addTests(doctest.DocTestSuite(importlib.import_module(f"quadpixel.{name}"), extraglobs=known))
    return tests
