"""Folders of real dual-pixel pictures as scenes, by their layout.

| layout | files | truth |
|---|---|---|
| phone (Xin et al., ICCV 2021) | `scenes/NNN_{left,right,defocus}.png`, `calibration/white_sheet_{left,right}.png`: 16 bits, linear, black 1024 | defocus of the middle, 8 bits, 0 unknown |
| DP119 (He et al., ICCV 2025) | `NAME/{l,r,d}.png`: sRGB | depth, 16 bits in mm or 8 bits of 10/255 m |
| DSLR (Punnappurath et al., ICCP 2020) | `NNNN_{L,R}.EXT`, `NNNN_{D,GT}.EXT`: sRGB | disparity up to a scale, 0 unknown |
| QPDD, QPD2K as re-arranged for QPDNet (Wu et al., BMVC 2024) | `PART_{l,r}/source/**/NAME.png`, `PART_c/target_disp/**/NAME.npy` or `PART_c/target_depth/**/NAME.tif`: sRGB | disparity; or 1/depth up to a scale |
| DPDD (Abuolaim and Brown, ECCV 2020) | `PART_{l,r}/source/NAME.png`: sRGB | none: time only |
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import List, Optional, Tuple

import cv2
import numpy as np

BLACK, WHITE = 1024, 16383
# Sensors of depth say nothing beyond, and what is nearer than a lens focuses is an error of theirs.
NEAREST_M, FARTHEST_M = 0.3, 10.0
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")


@dataclass
class Scene:
    """A pair of views and what is known of it."""

    name: str
    left: Path
    right: Path
    #: of qpalgo, so that it sees what `pair` holds
    flags: List[str]
    #: linear, one channel, evened by the white sheet where there is one
    pair: Tuple[np.ndarray, np.ndarray]
    #: affine in disparity, NaN where unknown; None: there is no truth
    truth: Optional[np.ndarray]
    #: whether `truth` is 1/depth in 1/m
    is_inverse_depth: bool = False
    size: Tuple[int, int] = field(init=False)

    def __post_init__(self):
        self.size = self.pair[0].shape


class UnknownLayout(ValueError):
    """A folder of no known layout."""


def read(path):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise UnknownLayout(f"{path}: no picture")
    return image


def linear(path):
    """Green of a picture in sRGB, 0 to 1."""
    image = read(path)
    codes = (image if image.ndim == 2 else image[..., 1]) / np.iinfo(image.dtype).max
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def fitted(truth, size):
    """A map at the views' size."""
    return truth if truth.shape == size else cv2.resize(truth, size[::-1], interpolation=cv2.INTER_NEAREST)


def middle(image, height, width):
    top, left = (image.shape[0] - height) // 2, (image.shape[1] - width) // 2
    return image[top : top + height, left : left + width]


def phone(folder):
    def light(path):
        return np.clip(read(path).astype(np.float64) - BLACK, 0, None) / WHITE

    sheets = [folder / f"calibration/white_sheet_{side}.png" for side in ("left", "right")]
    ratio = np.divide(*(cv2.blur(light(sheet), (101, 101)) for sheet in sheets))
    for defocus in sorted((folder / "scenes").glob("*_defocus.png")):
        name = defocus.name.removesuffix("_defocus.png")
        left, right = (folder / f"scenes/{name}_{side}.png" for side in ("left", "right"))
        truth = read(defocus) / 255
        height, width = truth.shape
        pair = tuple(middle(image, height, width) for image in (light(left), light(right) * ratio))
        flags = ["--black-level", str(BLACK), "--crop", f"{width}x{height}", "--white-sheet", f"{sheets[0]},{sheets[1]}"]
        yield Scene(name, left, right, flags, pair, np.where(truth > 0, truth, np.nan))


def read_depth(path, size):
    """Depth of DP119 in m, 0 unknown, at the views' size."""
    raw = read(path)
    metres = raw / 1000 if raw.dtype == np.uint16 else raw * (10 / 255)
    return fitted(metres if metres.ndim == 2 else metres[..., 0], size)


def dp119(folder):
    for depth in sorted(folder.glob("*/d.png")):
        left, right = depth.with_name("l.png"), depth.with_name("r.png")
        pair = (linear(left), linear(right))
        metres = read_depth(depth, pair[0].shape)
        known = (metres > NEAREST_M) & (metres < FARTHEST_M)
        truth = np.where(known, 1 / np.where(known, metres, 1), np.nan)
        yield Scene(depth.parent.name, left, right, ["--srgb"], pair, truth, is_inverse_depth=True)


def dslr(folder):
    for left in sorted(p for p in folder.iterdir() if p.stem.endswith("_L") and p.suffix.lower() in PICTURES):
        name = left.stem.removesuffix("_L")
        right = left.with_name(f"{name}_R{left.suffix}")
        truths = [p for end in ("D", "GT") for p in sorted(folder.glob(f"{name}_{end}.*"))]
        pair = (linear(left), linear(right))
        truth = None
        if truths:
            numbers = read(truths[0]).astype(np.float64)
            numbers = fitted(numbers if numbers.ndim == 2 else numbers[..., 0], pair[0].shape)
            truth = np.where(np.isfinite(numbers) & (numbers != 0), numbers, np.nan)
        yield Scene(name, left, right, ["--srgb"], pair, truth)


def parted(folder):
    """QPDD, QPD2K, DPDD: the first of test, val, train that is there."""
    part = next(p for p in ("test", "val", "train") if (folder / f"{p}_l/source").is_dir())
    root = folder / f"{part}_l/source"
    for left in sorted(p for p in root.rglob("*") if p.suffix.lower() in PICTURES):
        beside = left.relative_to(root)
        right = folder / f"{part}_r/source" / beside
        pair = (linear(left), linear(right))
        truth = None
        shift = (folder / f"{part}_c/target_disp" / beside).with_suffix(".npy")
        depth = [p for p in (folder / f"{part}_c/target_depth" / beside.parent).glob(f"{left.stem}.*") if p.suffix.lower() in PICTURES]
        if shift.exists():
            numbers = fitted(np.load(shift).squeeze().astype(np.float64), pair[0].shape)
            truth = np.where(np.isfinite(numbers) & (np.abs(numbers) < 512), numbers, np.nan)
        elif depth:
            numbers = fitted(read(depth[0]).astype(np.float64), pair[0].shape)
            truth = np.where(np.isfinite(numbers) & (numbers > 0), numbers, np.nan)
        yield Scene(str(beside.with_suffix("")), left, right, ["--srgb"], pair, truth)


def scenes(folder):
    """The scenes of a folder, by its layout; `UnknownLayout` where there is none."""
    folder = Path(folder)
    if (folder / "scenes").is_dir() and (folder / "calibration").is_dir():
        found = phone(folder)
    elif any((folder / f"{p}_l/source").is_dir() for p in ("test", "val", "train")):
        found = parted(folder)
    elif any(folder.glob("*/d.png")):
        found = dp119(folder)
    elif folder.is_dir() and any(p.stem.endswith("_L") for p in folder.iterdir()):
        found = dslr(folder)
    else:
        raise UnknownLayout(f"{folder}: no pairs of a known layout (scripts/benchmark/sets.py lists them)")
    for scene in found:
        if scene.pair[0].shape != scene.pair[1].shape:
            raise UnknownLayout(f"{scene.left}: {scene.pair[0].shape}, {scene.right}: {scene.pair[1].shape}: both views must be of one size")
        yield scene
