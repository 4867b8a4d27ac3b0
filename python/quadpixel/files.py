"""EXR and PNG files as NumPy arrays."""

import io
import os

import cv2
import numpy as np
import OpenEXR


def _bytes(source):
    if isinstance(source, (bytes, bytearray, memoryview)):
        return bytes(source)
    with open(os.fspath(source), "rb") as file:
        return file.read()


def read_exr(source):
    """Channels of an EXR file by their full names, such as ``A.R`` or ``Z``.

    ``source`` is a path or the file's bytes. Each channel is an (H, W) float32 array: half floats are widened, exactly.
    """
    with OpenEXR.File(io.BytesIO(_bytes(source)), separate_channels=True) as file:
        channels = file.channels()
        return {name: np.array(channel.pixels, dtype=np.float32) for name, channel in channels.items()}


def read_png(source):
    """Codes of a PNG file: (H, W) or (H, W, 3), uint8 or uint16 as stored, colours in the order R, G, B.

    ``source`` is a path or the file's bytes.
    """
    codes = cv2.imdecode(np.frombuffer(_bytes(source), dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if codes is None:
        raise ValueError(f"not a readable PNG: {source if isinstance(source, (str, os.PathLike)) else 'bytes'}")
    return codes if codes.ndim == 2 else np.ascontiguousarray(codes[..., ::-1])


def stack(channels, names, colours):
    """(len(names), H, W, len(colours)) float32 array of the layers ``names``; the empty name has no prefix."""
    def full(name, colour):
        return f"{name}.{colour}" if name else colour

    return np.stack([np.stack([channels[full(n, c)] for c in colours], axis=-1) for n in names])
