"""Reads quadpixel datasets (see SPEC.md of the project) into NumPy arrays.

All pictures have row 0 on top and are linear, 1 = the sensor's white in the sum of the sub-pixels. All maps have the size of a
view, H x W pixels (1 px = 1 microlens); NaN means: no truth there, and ``valid`` is False at the same pixels.
"""

from .dataset import ITEMS, Dataset, decode
from .files import read_exr, read_png
from .geometry import (
    LUMINANCE,
    channel_disparity,
    depth_from_disparity,
    depth_from_left_right,
    disparity_ratio,
    halves,
    left_right,
    mosaic_channels,
    side_members,
    subpixel_names,
)
from .shards import iterate_shard, iterate_shards

__all__ = [
    "ITEMS",
    "LUMINANCE",
    "Dataset",
    "channel_disparity",
    "decode",
    "depth_from_disparity",
    "depth_from_left_right",
    "disparity_ratio",
    "halves",
    "iterate_shard",
    "iterate_shards",
    "left_right",
    "mosaic_channels",
    "read_exr",
    "read_png",
    "side_members",
    "subpixel_names",
]
__version__ = "0.1.0"
