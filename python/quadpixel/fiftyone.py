"""Datasets in the FiftyOne app: `to_fiftyone`, or `Importer` for ``fiftyone.Dataset.from_importer``. Needs FiftyOne (``pip install quadpixel[fiftyone]``)."""

# FiftyOne's own methods only raise, which pyright takes for their type.
# pyright: reportIncompatibleMethodOverride=false

from __future__ import annotations

import os
from typing import Any, Dict, Iterator, List, Optional, Tuple

import fiftyone
import fiftyone.utils.data
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ._arrays import Floats
from .dataset import Dataset
from .geometry import subpixel_counts, subpixel_names
from .pictures import picture

Bytes = NDArray[np.uint8]

#: maps that are shown over each picture: item, key of a sample, unit, whether it has a sign
MAPS = (
    ("depth", "depth", "m", False),
    ("disparity", "left_right", "px", True),
    ("coc", "coc", "px", True),
    ("occlusion", "occlusion", "part", False),
)


class Importer(fiftyone.utils.data.GroupDatasetImporter):  # type: ignore[misc, unused-ignore]
    """The samples of a dataset as groups: the slice ``sum``, ``target``, and one per sub-pixel's view, 8-bit sRGB.

    dataset_dir  folder of the dataset
    pictures     new folder for what is shown, since FiftyOne takes no linear EXR; None: dataset_dir with ``-fiftyone`` behind it
    split        'train', 'val', 'test', or None for all; it becomes a tag

    The slice ``sum`` has `depth`, `left_right`, `coc` and `occlusion` as heatmaps, from black (least) to white (largest), or with 0 in their
    midst where they have a sign; fields with ``_range`` behind the name hold these two numbers, in m and px. `lens`, `f_number`, `focus_m` and `scene` are
    fields to filter by. What a dataset lacks is left out.
    """

    def __init__(
        self, dataset_dir: "str | os.PathLike[str]", pictures: "str | os.PathLike[str] | None" = None, split: Optional[str] = None, **settings: Any
    ):
        super().__init__(dataset_dir=os.fspath(dataset_dir), **settings)
        files = {entry["path"].rsplit("/", 1)[-1] for entry in Dataset(dataset_dir).manifest["files"]}
        self._maps = [m for m in MAPS if f"{m[0]}.exr" in files or f"{m[0]}.png" in files]
        items = ["views", "target", *(m[0] for m in self._maps)]
        self._source = Dataset(dataset_dir, split=split, items=items)
        self._splits = {entry["id"]: entry["split"] for entry in self._source.manifest["samples"]}
        # Beside the dataset, since nothing of others' belongs into it.
        self._folder = os.path.abspath(os.fspath(pictures) if pictures is not None else os.path.normpath(dataset_dir) + "-fiftyone")
        if os.path.isdir(self._folder) and os.listdir(self._folder):
            raise ValueError(f"pictures: {self._folder} holds files already; allowed: a new or an empty folder")
        self._order: Iterator[int] = iter(())

    def setup(self) -> None:
        os.makedirs(self._folder, exist_ok=True)
        self._order = iter(self._preprocess_list(list(range(len(self._source)))))

    def __len__(self) -> int:
        if not len(self._source):
            return 0
        return len(self._source) * (2 + int(np.prod(subpixel_counts(self._source.meta(0)))))

    @property
    def has_dataset_info(self) -> bool:
        return True

    @property
    def has_sample_field_schema(self) -> bool:
        return False

    def get_dataset_info(self) -> Dict[str, Any]:
        """What ``dataset.json`` says of units and conventions."""
        manifest = self._source.manifest
        return {key: manifest[key] for key in ("units", "conventions", "licence") if key in manifest}

    def __next__(self) -> Dict[str, Any]:
        sample = self._source[next(self._order)]
        meta = sample["meta"]
        group = fiftyone.Group()
        tags = [self._splits[sample["id"]]]
        folder = os.path.join(self._folder, sample["id"])
        os.makedirs(folder, exist_ok=True)
        shown = {}
        for name, values in _shown(sample).items():
            path = os.path.join(folder, f"{name}.png")
            _write(path, values)
            shown[name] = fiftyone.Sample(filepath=path, tags=tags, group=group.element(name), sample=sample["id"])
        for key, value in (("lens", meta["lens"]["name"]), ("f_number", meta["lens"]["f_number"]), ("focus_m", meta["focus"]["distance_m"]),
                           ("scene", meta["scene"]["id"])):
            shown["sum"][key] = value
        for _, key, _, signed in self._maps:
            if key not in sample:
                continue
            codes, ends = heat(sample[key], signed)
            path = os.path.join(folder, f"{key}.png")
            _write(path, codes)
            shown["sum"][key] = fiftyone.Heatmap(map_path=path, range=[0, 255])
            shown["sum"][f"{key}_range"] = ends
        return shown


def to_fiftyone(
    root: "str | os.PathLike[str]", pictures: "str | os.PathLike[str] | None" = None, split: Optional[str] = None, name: Optional[str] = None
) -> Any:
    """A FiftyOne dataset of the dataset in ``root`` (see `Importer`); ``fiftyone.launch_app`` shows it.

    name  of the FiftyOne dataset; None: one that FiftyOne makes up
    """
    return fiftyone.Dataset.from_importer(Importer(root, pictures, split), name=name)


def _shown(sample: Dict[str, Any]) -> Dict[str, Bytes]:
    """sRGB bytes by slice, all on one scale of brightness."""
    white = max(float(np.quantile(sample["sum"], 0.99)), 1e-12)
    names = subpixel_names(*subpixel_counts(sample["meta"]))
    parts = [("sum", sample["sum"], white), ("target", sample["target"], white)]
    parts += [(f"view-{n}", view, white / len(names)) for n, view in zip(names, sample["views"])]
    return {name: (picture(linear, most) * 255.0 + 0.5).astype(np.uint8) for name, linear, most in parts}


def heat(values: Floats, signed: bool) -> Tuple[Bytes, List[float]]:
    """A map as bytes, and the values at 0 and 255. Where it is not finite it is as its least value, or 0 with a sign.

    >>> heat(np.array([[-1.0, 0.0, 3.0, np.nan]], dtype=np.float32), True)
    (array([[ 85, 128, 255, 128]], dtype=uint8), [-3.0, 3.0])
    """
    known = np.isfinite(values)
    least, most = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 1.0)
    if signed:
        most = max(abs(least), abs(most))
        least = -most
    span = (most - least) or 1.0
    filled = np.where(known, values, 0.0 if signed else least)
    return ((filled - least) / span * 255.0 + 0.5).astype(np.uint8), [least, most]


def _write(path: str, values: Bytes) -> None:
    aside = f"{path}.aside"
    Image.fromarray(values).save(aside, format="PNG")
    os.replace(aside, path)
