"""A dataset as a sequence of samples."""

import json
import os

import numpy as np

from . import paths
from .files import read_exr, read_jpeg, read_png, stack
from .geometry import left_right, subpixel_counts, subpixel_names

SCHEMA_VERSION = 3

#: What a sample can be asked for, and the file it comes from.
ITEMS = {
    "raw": None,  # raw.png or raw.exr, as meta.json says
    "views": "views.exr",
    "target": "target.exr",
    "depth": "depth.exr",
    "distance": "distance.exr",
    "disparity": "disparity.exr",
    "coc": "coc.exr",
    "shifts": "shifts.exr",
    "occlusion": "occlusion.png",
    "objects": "objects.png",
    "normal": "normal.exr",
    "valid": "valid.png",
    "noisy": "noisy.png",
    "noisy_views": "noisy_views.exr",
    "shading": "shading.exr",
    "mosaic": "mosaic.png",
    "noisy_mosaic": "noisy_mosaic.png",
    "camera_picture": None,  # camera.jpg or camera.png, as meta.json says
    "camera_views": None,  # camera_views.jpg or camera_views.png
}


def _file_of(item, meta):
    if item in ("camera_picture", "camera_views"):
        jpeg = (meta.get("camera_pictures") or {}).get("jpeg_quality") is not None
        return f"{item.replace('_picture', '')}.{'jpg' if jpeg else 'png'}"
    return ITEMS[item] or f"raw.{_one_of(meta['raw']['format'], ('png', 'exr'), 'raw.format')}"


def _one_of(value, allowed, what):
    if value not in allowed:
        raise ValueError(f"{what} is {value!r}; allowed: {', '.join(map(str, allowed))}")
    return value


def _check_meta(meta):
    """Raises ValueError if what sizes are taken from in a ``meta.json`` is no such thing."""
    sensor, named = meta["sensor"], f"sample {meta['id']!r}: "
    for field in ("width_px", "height_px"):
        if not (isinstance(sensor[field], int) and 1 <= sensor[field] <= 1 << 16):
            raise ValueError(f"{named}sensor.{field} is {sensor[field]!r}; allowed: 1 to {1 << 16}")
    for count in subpixel_counts(meta):
        _one_of(count, range(1, 17), f"{named}sub-pixels of a side")
    _one_of([channel["name"] for channel in meta["channels"]], (["R", "G", "B"], ["Y"]), f"{named}channels")


def _check_lengths(files, meta):
    """Raises ValueError if a file has another length than ``meta.json`` says."""
    for entry in meta["contents"]:
        content = files.get(entry["path"])
        if content is not None and len(content) != entry["bytes"]:
            raise ValueError(f"sample {meta['id']!r}: {entry['path']} has {len(content)} bytes, meta.json says {entry['bytes']}")


def _check_size(sample, meta):
    """Raises ValueError if a picture has another size than the sensor."""
    height, width = meta["sensor"]["height_px"], meta["sensor"]["width_px"]
    columns, rows = subpixel_counts(meta)
    for name, picture in sample.items():
        if not isinstance(picture, np.ndarray):
            continue
        mosaic = name in ("raw", "noisy", "mosaic", "noisy_mosaic")
        layered = name in ("views", "noisy_views", "camera_views", "shading", "disparity", "paraxial")
        size = picture.shape[1:3] if layered else picture.shape[:2]
        expected = (height * rows, width * columns) if mosaic else (height, width)
        if size != expected:
            raise ValueError(f"sample {meta['id']!r}: {name} is {size}, the sensor's is {expected} (rows, columns)")


def check_version(description, named=""):
    """Raises ValueError if a ``dataset.json``, ``meta.json`` or ``camera.json`` is of another schema version than this package reads."""
    version = description.get("schema_version")
    if version == SCHEMA_VERSION:
        return
    if isinstance(version, int) and version < SCHEMA_VERSION:
        raise ValueError(
            f"{named}schema version {version}: it was made by an earlier release, and this one reads version {SCHEMA_VERSION}; "
            "make it again with `qpgen render` of a sample's meta.json, or with `qpgen dataset`"
        )
    raise ValueError(f"{named}schema version {version}; this package reads {SCHEMA_VERSION}")


def decode(files, items=None):
    """A sample from the content of its files.

    ``files`` maps names (``views.exr``, ``meta.json`` ...) to bytes, as a WebDataset gives them; ``items`` names what to decode
    (None: all that is there). Returns a dict:

    ========================  ==================  ==================================================================
    key                       shape, type         meaning
    ========================  ==================  ==================================================================
    id, meta                  str, dict           name, and ``meta.json``
    camera                    dict                ``camera.json``: what the camera knows of itself, for estimates
    raw                       (nH, mW, 3) f32     clean sub-pixel mosaic, linear
    views, sum                (mn, H, W, 3) f32   clean views in stored order, linear; their sum (H, W, 3)
    target                    (H, W, 3) f32       all in focus, linear, on the scale of the sum
    depth                     (H, W) f32          z along the axis, m from the first lens vertex; sky is +inf
    distance                  (H, W) f32          ray distance, m: not the depth
    disparity                 (mn, H, W, 2) f32   (dx, dy) of each view against the sum, px, dx right, dy down; traced, of green
    paraxial                  (mn, H, W, 2) f32   the same of the ideal lens
    left_right                (H, W) f32          x_L - x_R, px, positive nearer than the focus (m > 1; with disparity)
    coc                       (H, W) f32          signed circle of confusion, px, positive behind the focus
    shifts                    (H, W, 2) f32       (dx, dy) of the sum from where the chief ray meets the point, px
    channel_shifts            dict or None        'R', 'B': (mn + 1, H, W, 2) f32, each view's disparity minus green's, px; last
                                                  where the channel's sum shows the point, from green's (`channel_disparity`)
    occlusion                 (H, W) f32          part of the pupil that sees another surface, 0 to 1
    objects                   (H, W) u16          number of the object seen, 65535 where none (worlds of meshes only)
    normal                    (H, W, 3) f32       its unit normal, X right, Y up, Z into the scene (worlds of meshes only)
    valid                     (H, W) bool         where depth, distance, disparity and coc apply (they are NaN elsewhere)
    noisy                     (nH, mW, 3) u16     digital numbers of the noisy mosaic
    noisy_views, noisy_sum    as views, sum       the same as linear values; some are negative
    shading                   (mn, H, W, 3) f32   what a white wall gives on each sub-pixel, linear
    mosaic                    (nH, mW) f32        of raw each microlens's own colour (`mosaic_channels`), linear
    noisy_mosaic              (nH, mW) u16        of noisy the same: digital numbers; levels in meta["mosaic"]["noisy"]
    camera_picture            (H, W, 3) u8        the sum as a camera writes it, 8-bit sRGB (`linear_from_codes` undoes it)
    camera_views              (mn, H, W, 3) u8    the views alike
    ========================  ==================  ==================================================================
    """
    meta = json.loads(files["meta.json"])
    check_version(meta)
    _check_meta(meta)
    _check_lengths(files, meta)
    if items is None:
        items = [item for item in ITEMS if _file_of(item, meta) in files]
    columns, rows = subpixel_counts(meta)
    names = subpixel_names(columns, rows)
    colours = [channel["name"] for channel in meta["channels"]]
    sample = {"id": meta["id"], "meta": meta}
    if "camera.json" in files:
        sample["camera"] = json.loads(files["camera.json"])
        check_version(sample["camera"])
    for item in items:
        file = _file_of(item, meta)
        if file not in files:
            raise KeyError(f"sample {meta['id']} has no {file}")
        content = files[file]
        if item == "raw":
            sample[item] = _raw(content, meta, colours)
        elif item in ("views", "noisy_views"):
            channels = read_exr(content)
            sample[item] = stack(channels, names, colours)
            sample[item.replace("views", "sum")] = stack(channels, ["sum"], colours)[0]
        elif item == "shading":
            sample[item] = stack(read_exr(content), names, colours)
        elif item == "target":
            sample[item] = stack(read_exr(content), [""], colours)[0]
        elif item == "disparity":
            channels = read_exr(content)
            sample[item] = stack(channels, names, ["dx", "dy"])
            sample["paraxial"] = stack(channels, names, ["paraxial_dx", "paraxial_dy"])
            if columns > 1:
                sample["left_right"] = left_right(sample[item], meta)
        elif item == "shifts":
            channels = read_exr(content)
            sample[item] = stack(channels, ["sum"], ["dx", "dy"])[0]
            layers = names + ["sum"]
            differ = meta["truth"]["channels_differ"]
            colour = {c: stack(channels, layers, [f"{c}.dx", f"{c}.dy"]) for c in "RB"} if differ else None
            sample["channel_shifts"] = colour
        elif item in ("depth", "distance", "coc"):
            (sample[item],) = read_exr(content).values()
        elif item == "occlusion":
            sample[item] = read_png(content).astype(np.float32) / 255.0
        elif item == "valid":
            sample[item] = read_png(content) != 0
        elif item == "normal":
            sample[item] = stack(read_exr(content), [""], ["X", "Y", "Z"])[0]
        elif item == "mosaic":
            sample[item] = _linear(content, meta)
        elif item in ("noisy", "noisy_mosaic", "objects"):
            sample[item] = read_png(content)
        elif item in ("camera_picture", "camera_views"):
            codes = read_jpeg(content) if file.endswith(".jpg") else read_png(content)
            sample[item] = codes if item == "camera_picture" else _tiles(codes, columns, rows, meta)
        else:
            raise KeyError(f"{item!r} is none of {', '.join(ITEMS)}")
    _check_size(sample, meta)
    return sample


def _tiles(codes, columns, rows, meta):
    """(mn, H, W, 3) of views side by side."""
    height, width = meta["sensor"]["height_px"], meta["sensor"]["width_px"]
    if codes.shape != (rows * height, columns * width, 3):
        raise ValueError(f"sample {meta['id']!r}: camera_views is {codes.shape}, expected {(rows * height, columns * width, 3)}")
    return codes.reshape(rows, height, columns, width, 3).swapaxes(1, 2).reshape(rows * columns, height, width, 3)


def _raw(content, meta, colours):
    levels = meta["raw"]
    if levels["format"] == "exr":
        return stack(read_exr(content), [""], colours)[0]
    return _linear(content, meta)


def _linear(content, meta):
    levels = meta["raw"]
    codes = read_png(content).astype(np.float64)
    span = levels["white_level"] - levels["black_level"]
    return ((codes - levels["black_level"]) * (levels["linear_at_white"] / span)).astype(np.float32)


class Dataset:
    """A map-style dataset, as ``torch.utils.data.DataLoader`` takes it: ``len(d)`` samples, ``d[i]`` a dict (see `decode`).

    root       folder of the dataset
    split      'train', 'val', 'test', or None for all; splits are by scene
    items      what to load, of `ITEMS`
    transform  called with each dict; its result is what ``d[i]`` gives
    """

    def __init__(self, root, split=None, items=("views", "target", "depth", "disparity", "valid"), transform=None):
        self.root = os.fspath(root)
        #: ``dataset.json``: configuration, units, conventions, licence
        self.manifest = json.loads(paths.read(self.root, "dataset.json"))
        check_version(self.manifest, f"{self.root}: ")
        if split not in (None, "train", "val", "test"):
            raise ValueError(f"split is {split!r}; allowed: 'train', 'val', 'test', None")
        unknown = [item for item in items if item not in ITEMS]
        if unknown:
            raise ValueError(f"items has {unknown[0]!r}; allowed: {', '.join(ITEMS)}")
        #: names of the samples, in order
        self.ids = [
            paths.plain_name(entry["id"], f"{self.root}: a sample's id")
            for entry in self.manifest["samples"]
            if split in (None, entry["split"])
        ]
        self._lengths = {entry["path"]: entry["bytes"] for entry in self.manifest["files"] if entry["path"].endswith("/meta.json")}
        self.items = tuple(items)
        self.transform = transform

    def __len__(self):
        return len(self.ids)

    def _read(self, index, name):
        content = paths.read(self.root, "samples", self.ids[index], name)
        listed = self._lengths.get(f"samples/{self.ids[index]}/{name}", len(content))
        if listed != len(content):
            raise ValueError(f"{self.root}: sample {self.ids[index]}: {name} has {len(content)} bytes, dataset.json says {listed}")
        return content

    def meta(self, index):
        """``meta.json`` of a sample: lens, focus, intrinsics, exposure, noise, ranges."""
        return json.loads(self._read(index, "meta.json"))

    def __getitem__(self, index):
        if not -len(self) <= index < len(self):
            raise IndexError(index)
        files = {name: self._read(index, name) for name in ("meta.json", "camera.json")}
        meta = json.loads(files["meta.json"])
        for item in self.items:
            name = _file_of(item, meta)
            files[name] = self._read(index, name)
        sample = decode(files, self.items)
        return sample if self.transform is None else self.transform(sample)
