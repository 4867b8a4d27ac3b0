"""Batches of crops from packed pairs, with what cameras add: noise, gain, tone, 8 bits, mirror images, other scales."""

import numpy as np
import torch
from torch.nn import functional


class Batches:
    """Draws of crops, seeded: batch number `n` is the same whatever was drawn before.

    `files` are of `pack.py`; `noise` is the largest standard deviation of a view at white, a part of white, or 0; `shape`: rows and
    columns of the pairs that are taken, or None.
    """

    def __init__(self, files, side, size, seed, noise, shape=None):
        self.groups = []
        for file in files:
            arrays = np.load(file)
            names = sorted(n.removeprefix("views_") for n in arrays.files if n.startswith("views_"))
            names = [n for n in names if shape is None or n == "x".join(map(str, shape))]
            self.groups += [[arrays[f"{kind}_{n}"] for kind in ("views", "disparity", "weight")] for n in names]
        self.ends = np.cumsum([len(group[0]) for group in self.groups])
        self.side, self.size, self.seed, self.noise = side, size, seed, noise

    def __len__(self):
        return int(self.ends[-1])

    def batch(self, number):
        """`views` (size, 2, side, side): roots; `truth` and `weight` (size, side / 2, side / 2), at every second pixel."""
        rng = np.random.default_rng([self.seed, number])
        # One scale for the batch: the views made smaller, so that the noise of a crop is not that of its blur.
        scale = 1.0 if rng.random() < 0.4 else rng.uniform(1.0, 4 / 3)
        side = int(self.side * scale) // 2 * 2
        crops = [self._crop(rng, side) for _ in range(self.size)]
        views, truth, weight = (torch.from_numpy(np.stack(part)) for part in zip(*crops, strict=True))
        if side != self.side:
            factor = self.side / side
            views = functional.interpolate(views, size=(self.side,) * 2, mode="bilinear", antialias=True)
            # Pixel i of the small picture lies at (i + 1/2) / factor - 1/2 of the large one.
            at = ((torch.arange(0, self.side, 2) + 0.5) / factor - 0.5).round().long().clamp(0, side - 1)
            truth, weight = (x[:, at][:, :, at] for x in (truth * factor, weight))
        else:
            truth, weight = (x[:, ::2, ::2] for x in (truth, weight))
        return self._captured(rng, views), truth, weight

    def _crop(self, rng, side):
        index = int(rng.integers(len(self)))
        group = int(np.searchsorted(self.ends, index, side="right"))
        views, disparity, weight = self.groups[group]
        index -= int(self.ends[group - 1]) if group else 0
        height, width = disparity.shape[1:]
        y, x = (int(rng.integers(n - side + 1)) for n in (height, width))
        window = (slice(y, y + side), slice(x, x + side))
        grey = rng.uniform() if rng.random() < 0.5 else 0.0
        both = views[index][(slice(None), slice(None), *window)].astype(np.float32)
        view = (1 - grey) * both[:, 0] + grey * both[:, 1]
        truth = disparity[index][window].astype(np.float32)
        known = weight[index][window].astype(np.float32) / 2
        if rng.random() < 0.5:
            view, truth, known = (np.flip(a, -2) for a in (view, truth, known))
        if rng.random() < 0.5:
            # In a mirror left is right: the disparity stays.
            view = np.flip(view, -1)[::-1]
            truth, known = (np.flip(a, -1) for a in (truth, known))
        return tuple(np.ascontiguousarray(a) for a in (view, truth, known))

    def _captured(self, rng, views):
        n = len(views)

        def each(values):
            return torch.from_numpy(np.asarray(values, np.float32)).reshape(n, -1, 1, 1)

        generator = torch.Generator().manual_seed(int(rng.integers(1 << 62)))
        # What evening leaves of shading: up to 4 % from side to side.
        ramp = torch.linspace(-1, 1, views.shape[-1])
        shading = 1 + each(rng.normal(0, 0.015, (n, 2))) * ramp[:, None] + each(rng.normal(0, 0.015, (n, 2))) * ramp
        views = views * shading * each(1 + rng.normal(0, 0.01, (n, 2)))
        if self.noise:
            most = each(np.where(rng.random(n) < 0.15, 0, self.noise * 10 ** rng.uniform(-1.5, 0, n)))
            floor = each(10 ** rng.uniform(-3, -1.3, n))
            deviation = most * torch.sqrt(views.clamp(min=0) + floor)
            views = views + deviation * torch.randn(views.shape, generator=generator)
        # Roots of linear numbers; a fifth as if a tone curve had not been undone quite, in 8 bits.
        toned = each(rng.random(n) < 0.2)
        power = torch.where(toned > 0, each(rng.uniform(0.35, 0.7, n)), 0.5)
        roots = views.clamp(min=1e-6) ** power
        roots = torch.where(toned > 0, (roots * 255).round() / 255, roots)
        white = torch.quantile(roots.mean(dim=1).flatten(1), 0.99, dim=1).reshape(n, 1, 1, 1)
        # The white of the whole picture may lie in another crop.
        return roots / white * each(10 ** rng.uniform(-0.15, 0.02, n))
