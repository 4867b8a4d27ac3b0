"""Batches of crops from packed pairs, with what cameras add: noise, gain, tone, 8 bits, mirror images, other scales."""

from pathlib import Path

import numpy as np
import torch
from torch.nn import functional

#: Least and largest logarithm of a standard deviation in px that the network is told.
LOG_SIGMA = (-5.0, 3.0)


def matched_file(pairs):
    """Where `match.py` puts what it found of a file of pairs."""
    return Path(pairs).with_suffix(".matched.npz")


def drawn_capture(rng, noise):
    """How a pair is taken: the part of grey in the colour, the noise at white, and what light it has at black, parts of white."""
    grey = rng.uniform() if rng.random() < 0.5 else 0.0
    deviation = 0.0 if rng.random() < 0.15 else noise * 10 ** rng.uniform(-1.5, 0)
    return np.array([grey, deviation, 10 ** rng.uniform(-3, -1.3)], np.float32)


def taken(both, capture, seed):
    """A pair (2, green and grey, H, W) as a capture has it: (2, H, W). The seed says the noise."""
    grey, deviation, floor = capture
    views = (1 - grey) * both[:, 0].astype(np.float32) + grey * both[:, 1].astype(np.float32)
    if deviation > 0:
        noise = np.random.default_rng(seed).standard_normal(views.shape, dtype=np.float32)
        views = views + deviation * np.sqrt(views.clip(0) + floor) * noise
    return views.astype(np.float32)


class Batches:
    """Draws of crops, seeded: batch number `n` is the same whatever was drawn before.

    `files` are of `pack.py`; `noise` is the largest standard deviation of a view at white, a part of white, or 0; `shape`: rows and
    columns of the pairs that are taken, or None; `matched`: with what `match.py` found, and its captures in the place of drawn ones.
    """

    def __init__(self, files, side, size, seed, noise, shape=None, matched=False):
        self.groups = []
        for file in files:
            arrays = np.load(file)
            names = sorted(n.removeprefix("views_") for n in arrays.files if n.startswith("views_"))
            names = [n for n in names if shape is None or n == "x".join(map(str, shape))]
            more = np.load(matched_file(file)) if matched else None
            for name in names:
                kept = {kind: arrays[f"{kind}_{name}"] for kind in ("views", "disparity", "weight")}
                if matched:
                    kept |= {kind: more[f"{kind}_{name}"] for kind in ("capture", "matched")}
                self.groups.append(kept)
        self.ends = np.cumsum([len(group["views"]) for group in self.groups])
        self.side, self.size, self.seed, self.noise = side, size, seed, noise
        self.matched = matched

    def __len__(self):
        return int(self.ends[-1])

    def batch(self, number):
        """`views` (size, 2, side, side): roots; at every second pixel `truth` and `weight` (size, side / 2, side / 2), and `matched`
        (size, 2, side / 2, side / 2): disparity and logarithm of σ, or None."""
        rng = np.random.default_rng([self.seed, number])
        # One scale for the batch: the views made smaller, so that the noise of a crop is not that of its blur.
        scale = 1.0 if rng.random() < 0.4 else rng.uniform(1.0, 4 / 3)
        side = int(self.side * scale) // 2 * 2
        crops = [self._crop(rng, side) for _ in range(self.size)]
        views, maps = (torch.from_numpy(np.stack(part)) for part in zip(*crops, strict=True))
        factor = self.side / side
        if side == self.side:
            maps = maps[..., ::2, ::2]
        else:
            views = functional.interpolate(views, size=(self.side,) * 2, mode="bilinear", antialias=True)
            # Pixel i of the small picture lies at (i + 1/2) / factor - 1/2 of the large one.
            at = ((torch.arange(0, self.side, 2) + 0.5) / factor - 0.5).round().long().clamp(0, side - 1)
            maps = maps[..., at, :][..., at]
        truth, weight = maps[:, 0] * factor, maps[:, 1] / 2
        matched = torch.stack([maps[:, 2] * factor, maps[:, 3] + np.log(factor)], dim=1) if self.matched else None
        return self._shown(rng, views), truth, weight, matched

    def _crop(self, rng, side):
        """A crop's views, and its maps: disparity, weight, and the two that were matched."""
        index = int(rng.integers(len(self)))
        group = int(np.searchsorted(self.ends, index, side="right"))
        kept = self.groups[group]
        index -= int(self.ends[group - 1]) if group else 0
        height, width = kept["disparity"].shape[1:]
        y, x = (int(rng.integers(n - side + 1)) for n in (height, width))
        window = (..., slice(y, y + side), slice(x, x + side))
        maps = [kept["disparity"][index][window], kept["weight"][index][window]]
        if self.matched:
            draw = int(rng.integers(kept["capture"].shape[1]))
            view = taken(kept["views"][index], kept["capture"][index, draw], [index, draw])[window]
            maps += list(kept["matched"][index, draw][window])
        else:
            view = taken(kept["views"][index][window], drawn_capture(rng, self.noise), int(rng.integers(1 << 62)))
        maps = np.stack(maps).astype(np.float32)
        if rng.random() < 0.5:
            view, maps = (np.flip(a, -2) for a in (view, maps))
        if rng.random() < 0.5:
            # In a mirror left is right: the disparity stays.
            view, maps = np.flip(view, -1)[::-1], np.flip(maps, -1)
        return tuple(np.ascontiguousarray(a) for a in (view, maps))

    def _shown(self, rng, views):
        """Roots of views with what evening leaves of shading, and of their tone."""
        n = len(views)

        def each(values):
            return torch.from_numpy(np.asarray(values, np.float32)).reshape(n, -1, 1, 1)

        # Up to 4 % from side to side.
        ramp = torch.linspace(-1, 1, views.shape[-1])
        shading = 1 + each(rng.normal(0, 0.015, (n, 2))) * ramp[:, None] + each(rng.normal(0, 0.015, (n, 2))) * ramp
        views = views * shading * each(1 + rng.normal(0, 0.01, (n, 2)))
        # Roots of linear numbers; a fifth as if a tone curve had not been undone quite, in 8 bits.
        toned = each(rng.random(n) < 0.2)
        power = torch.where(toned > 0, each(rng.uniform(0.35, 0.7, n)), 0.5)
        roots = views.clamp(min=1e-6) ** power
        roots = torch.where(toned > 0, (roots * 255).round() / 255, roots)
        white = torch.quantile(roots.mean(dim=1).flatten(1), 0.99, dim=1).reshape(n, 1, 1, 1)
        # The white of the whole picture may lie in another crop.
        return roots / white * each(10 ** rng.uniform(-0.15, 0.02, n))
