"""Samples rendered while a network is trained: `OnTheFly` for `torch.utils.data.DataLoader`. Needs PyTorch (``pip install quadpixel[torch]``)."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import torch.utils.data

from .algorithms import set_threads
from .camera import Camera
from .configuration import Configuration
from .rendering import Sample
from .rgbd import Pictures
from .scene import Charts, Worlds

#: a camera per sample, by a generator that is seeded for it
DrawCamera = Callable[[np.random.Generator], Camera]
Cameras = Union[Camera, Sequence[Camera], DrawCamera]


class OnTheFly(torch.utils.data.IterableDataset):  # type: ignore[type-arg, misc, unused-ignore]
    """Renders samples in the workers of a DataLoader: no dataset on disk, and none twice.

    source     `Charts`, `Worlds`, `Pictures` (the user's own, with depth), or a `Configuration`, which draws lens, pixel, focus and scene together
    cameras    with charts, worlds and pictures: a `Camera`, several (one is drawn per sample), or a function of a NumPy generator that makes one
    seed       takes the place of the source's; the same seed gives the same samples, whatever the number of workers
    length     samples per epoch
    items      what of a sample is given, of `decode`'s keys; ``index`` is the sample's number
    transform  called with each dict; its result is what is given
    threads    of each worker; None: the cores, shared evenly
    settings   of `Camera.render`: rays_per_pixel, exposure_ev; of `Camera.convert` also level

    Sample i of epoch e is number e * length + i of the source, rendered by worker i modulo the number of workers. `set_epoch` goes to another
    epoch, `state_dict` and `load_state_dict` go on in the midst of one.
    """

    def __init__(
        self,
        source: Union[Charts, Worlds, Pictures, Configuration],
        cameras: Optional[Cameras] = None,
        seed: int = 1,
        *,
        length: int = 1000,
        items: Sequence[str] = ("views", "target", "depth", "left_right", "valid"),
        transform: Optional[Callable[[Dict[str, Any]], Any]] = None,
        threads: Optional[int] = None,
        **settings: Any,
    ):
        super().__init__()
        if isinstance(source, Configuration) != (cameras is None):
            raise ValueError("cameras: allowed with charts, worlds and pictures, which need them; a configuration draws its own")
        if length < 1:
            raise ValueError(f"length is {length}; allowed: from 1")
        if isinstance(cameras, Sequence) and not cameras:
            raise ValueError("cameras is empty; allowed: at least one")
        known = ("rays_per_pixel", "exposure_ev", "level") if isinstance(source, Pictures) else ("rays_per_pixel", "exposure_ev")
        unknown = [name for name in settings if name not in known or cameras is None]
        if unknown:
            raise ValueError(f"settings: {unknown[0]!r}; allowed with cameras: {', '.join(known)}")
        # Pictures are there; only cameras, and the rays of "rays", are drawn by the seed.
        self._source = source if isinstance(source, Pictures) else source.with_seed(seed)
        self._cameras = cameras
        self._seed = seed
        self._length = length
        self._items = tuple(items)
        self._transform = transform
        self._threads = threads
        self._settings = settings
        self._epoch = 0
        self._begin = 0

    def __len__(self) -> int:
        return self._length

    def set_epoch(self, epoch: int) -> None:
        """Goes to the beginning of an epoch, from 0; before the DataLoader is iterated over."""
        if epoch < 0:
            raise ValueError(f"epoch is {epoch}; allowed: from 0")
        self._epoch, self._begin = epoch, 0

    def state_dict(self, taken: int = 0) -> Dict[str, int]:
        """What `load_state_dict` needs to go on after ``taken`` samples of this epoch were taken from the DataLoader.

        With W workers and batches of B, ``taken`` is a multiple of W * B: then all workers stand at the same place.
        """
        return {"epoch": self._epoch, "begin": self._begin + taken, "seed": self._seed, "length": self._length}

    def load_state_dict(self, state: Mapping[str, int]) -> None:
        """Goes on where `state_dict` was asked. ValueError for another seed or length."""
        if (state["seed"], state["length"]) != (self._seed, self._length):
            raise ValueError(f"state: seed and length are {state['seed']}, {state['length']}; allowed: {self._seed}, {self._length}")
        self._epoch, self._begin = state["epoch"], state["begin"]

    def sample(self, number: int) -> Sample:
        """Sample ``number``, whole, rendered here."""
        if isinstance(self._source, Configuration):
            return self._source.render(number)
        if isinstance(self._source, Pictures):
            rays_seed = int(np.random.default_rng([self._seed, number, 1]).integers(1 << 32))
            return self._camera(number).convert(self._source[number], seed=rays_seed, **self._settings)
        return self._camera(number).render(self._source[number], **self._settings)

    def _camera(self, number: int) -> Camera:
        cameras = self._cameras
        if isinstance(cameras, Camera):
            return cameras
        generator = np.random.default_rng([self._seed, number])
        if callable(cameras):
            return cameras(generator)
        assert cameras is not None
        return cameras[int(generator.integers(len(cameras)))]

    def __iter__(self) -> Iterator[Any]:
        first, step = self._share()
        for i in range(self._begin + first, self._length, step):
            number = self._epoch * self._length + i
            sample = self.sample(number)
            given = {name: sample[name] for name in self._items}
            given["index"] = number
            yield given if self._transform is None else self._transform(given)

    def _share(self) -> Tuple[int, int]:
        """First sample and distance of the samples of this worker, whose threads are set."""
        worker = torch.utils.data.get_worker_info()
        if worker is None:
            if self._threads is not None:
                set_threads(self._threads)
            return 0, 1
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        set_threads(self._threads if self._threads is not None else max(1, cores // worker.num_workers))
        return worker.id, worker.num_workers


__all__: List[str] = ["OnTheFly"]
