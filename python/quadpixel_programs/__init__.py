"""The commands `qpgen` and `qpalgo` of the wheel: the Rust part of `quadpixel`, without the rest of it and NumPy."""

import importlib.machinery
import importlib.util
import signal
import sys
from typing import Any


def _native() -> Any:
    package = importlib.util.find_spec("quadpixel")
    folders = package.submodule_search_locations if package else None
    spec = importlib.machinery.PathFinder.find_spec("_native", folders) if folders else None
    if spec is None or spec.loader is None:
        raise ImportError("quadpixel._native is missing: install the package again")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _as_a_program() -> None:
    # Python's own handler would keep Ctrl-C to itself until the command has ended. What nohup ignores stays ignored.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def qpgen() -> int:
    """Runs `qpgen` with the process's arguments; its exit code."""
    _as_a_program()
    return int(_native().qpgen(sys.argv))


def qpalgo() -> int:
    """Runs `qpalgo` with the process's arguments; its exit code."""
    _as_a_program()
    return int(_native().qpalgo(sys.argv))
