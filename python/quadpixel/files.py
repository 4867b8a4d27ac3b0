"""EXR, PNG and JPEG files as NumPy arrays."""

import os

import numpy as np

from . import _native


def _content(source):
    if isinstance(source, (bytes, bytearray, memoryview)):
        return bytes(source), "bytes"
    with open(os.fspath(source), "rb") as file:
        return file.read(), os.fspath(source)


def read_exr(source):
    """Channels of an EXR file by their full names, such as ``A.R`` or ``Z``.

    ``source`` is a path or the file's bytes. Each channel is an (H, W) float32 array: half floats are widened, exactly.
    """
    return _native.read_exr(*_content(source))


def read_png(source):
    """Codes of a PNG file: (H, W) or (H, W, 3), uint8 or uint16 as stored, colours in the order R, G, B.

    ``source`` is a path or the file's bytes.
    """
    return _native.read_png(*_content(source))


def read_jpeg(source):
    """Codes of a JPEG file: (H, W, 3) uint8, colours in the order R, G, B.

    ``source`` is a path or the file's bytes.
    """
    return _native.read_jpeg(*_content(source))


def stack(channels, names, colours):
    """(len(names), H, W, len(colours)) float32 array of the layers ``names``; the empty name has no prefix."""
    def full(name, colour):
        return f"{name}.{colour}" if name else colour

    return np.stack([np.stack([channels[full(n, c)] for c in colours], axis=-1) for n in names])
