"""Batches of crops from packed pairs, with what cameras add: crosstalk, noise, gain, tone, 8 bits, mirror images, other scales."""

from collections import Counter
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional

#: Least and largest logarithm of a standard deviation in px that the network is told.
LOG_SIGMA = (-5.0, 3.0)
#: Largest part of a view's light that its pixels give to the other view, where nothing else is said.
CROSSTALK = 0.35


def matched_file(pairs):
    """Where `match.py` puts what it found of a file of pairs."""
    return Path(pairs).with_suffix(".matched.npz")


def pair_files(names, folder):
    """Files of `make-data` by their cameras' names, such as "wave"; a name said twice counts twice."""
    found = []
    for name in names:
        files = sorted(Path(folder).glob(f"*/{name}.npz"))
        if not files:
            raise SystemExit(f"error: no */{name}.npz in {folder}: make-data makes them")
        found += files
    return found


class Draw:
    """Random numbers for `n` crops on a device, each (n, 1, 1, 1)."""

    def __init__(self, n, seed, device):
        self.n, self.device = n, device
        self.generator = torch.Generator(device).manual_seed(seed)

    def uniform(self, low=0.0, high=1.0, parts=1):
        drawn = torch.rand((self.n, parts, 1, 1), generator=self.generator, device=self.device)
        return low + (high - low) * drawn

    def normal(self, deviation, parts=1):
        return deviation * torch.randn((self.n, parts, 1, 1), generator=self.generator, device=self.device)

    def noise(self, shape):
        return torch.randn(shape, generator=self.generator, device=self.device)

    def below(self, ends):
        """A whole number below each of `ends` (n)."""
        return (self.uniform().flatten() * ends).long()

    def chance(self, part):
        return self.uniform() < part


def captured(both, noise, draw, most_crosstalk=CROSSTALK):
    """Pairs (n, 2, green and grey, H, W), linear, as captures have them (n, 2, H, W), and what the disparity (n, 1, 1, 1) is multiplied by.

    Half of them have a part of grey in their colour; half have crosstalk: a part c of each view's light, up to `most_crosstalk`, lies in the
    other, so that centroids move together by 1 - 2 c. Most have noise, up to `noise` at white, with some of it at black.
    """
    grey = torch.where(draw.chance(0.5), draw.uniform(), 0.0)
    views = (1 - grey) * both[:, :, 0].float() + grey * both[:, :, 1].float()
    crosstalk = torch.where(draw.chance(0.5), draw.uniform(0, most_crosstalk), 0.0)
    views = views + crosstalk * (views.flip(1) - views)
    deviation = torch.where(draw.chance(0.15), 0.0, noise * 10 ** draw.uniform(-1.5, 0))
    floor = 10 ** draw.uniform(-3, -1.3)
    views = views + deviation * torch.sqrt(views.clamp(min=0) + floor) * draw.noise(views.shape)
    return views, 1 - 2 * crosstalk


class Batches:
    """Draws of crops, seeded: batch number `n` is the same whatever was drawn before, on one kind of device.

    `files` are of `pack.py`; `noise` is the largest standard deviation of a view at white, a part of white, or 0; `crosstalk`: the largest
    part of a view's light in the other; `shape`: rows and columns of the pairs that are taken, or None; `matched`: with what `match.py`
    found, and its captures in the place of drawn ones. Everything lies on `device`, pixel after pixel.
    """

    def __init__(self, files, side, size, seed, noise, crosstalk=CROSSTALK, shape=None, matched=False, device="cpu"):
        self.side, self.size, self.seed = side, size, seed
        self.noise, self.crosstalk, self.matched, self.device = noise, crosstalk, matched, device
        kept = {kind: [] for kind in ("views", "disparity", "weight", *(("taken", "truth", "matched") if matched else ()))}
        places, chosen, begin = [], [], 0
        for file, times in Counter(files).items():
            arrays = np.load(file)
            more = np.load(matched_file(file)) if matched else {}
            for name in sorted(n.removeprefix("views_") for n in arrays.files if n.startswith("views_")):
                height, width = map(int, name.split("x"))
                if shape is not None and [height, width] != list(shape):
                    continue
                count = 0
                for kind, parts in kept.items():
                    values = torch.from_numpy((more if f"{kind}_{name}" in more else arrays)[f"{kind}_{name}"])
                    # (pairs, ..., H, W): the pairs' pixels one after the other.
                    parts.append(values.flatten(1, -3).movedim(0, 1).flatten(1) if values.ndim > 3 else values.reshape(1, -1))
                    count = len(values)
                chosen += times * list(range(len(places), len(places) + count))
                places += [(begin + i * height * width, height, width) for i in range(count)]
                begin += count * height * width
        if not places:
            raise SystemExit(f"error: no pairs of {shape} px in {len(files)} files")
        self.kept = {kind: torch.cat(parts, dim=1).to(device) for kind, parts in kept.items()}
        self.places, self.chosen = (torch.tensor(x, device=device) for x in (places, chosen))

    def __len__(self):
        return len(self.chosen)

    def batch(self, number):
        """`views` (size, 2, side, side): roots; at every second pixel `truth` and `weight` (size, side / 2, side / 2), and `matched`
        (size, 2, side / 2, side / 2): disparity and logarithm of σ, or None."""
        host = np.random.default_rng([self.seed, number])
        draw = Draw(self.size, int(host.integers(1 << 62)), self.device)
        # One scale for the batch: the views made smaller, so that the noise of a crop is not that of its blur.
        scale = 1.0 if host.random() < 0.4 else host.uniform(1.0, 4 / 3)
        side = int(self.side * scale) // 2 * 2
        views, maps = self._crops(draw, side)
        factor = self.side / side
        if side == self.side:
            maps = maps[..., ::2, ::2]
        else:
            views = functional.interpolate(views, size=(self.side,) * 2, mode="bilinear", antialias=True)
            # Pixel i of the small picture lies at (i + 1/2) / factor - 1/2 of the large one.
            at = ((torch.arange(0, self.side, 2, device=self.device) + 0.5) / factor - 0.5).round().long().clamp(0, side - 1)
            maps = maps[..., at, :][..., at]
        truth, weight = maps[:, 0] * factor, maps[:, 1] / 2
        matched = torch.stack([maps[:, 2] * factor, maps[:, 3] + np.log(factor)], dim=1) if self.matched else None
        return shown(views, draw), truth, weight, matched

    def _crops(self, draw, side):
        """Views, and maps: disparity, weight, and the two that were matched."""
        begin, height, width = self.places[self.chosen[draw.below(len(self.chosen))]].T
        along = torch.arange(side, device=self.device).reshape(1, 1, side)
        turned, mirrored = draw.chance(0.5), draw.chance(0.5)
        y, x = (
            draw.below(n - side + 1)[:, None] + torch.where(flip, side - 1 - along, along)[:, 0, 0]
            for n, flip in ((height, turned), (width, mirrored))
        )
        index = begin[:, None, None] + y[:, :, None] * width[:, None, None] + x[:, None, :]
        weight = self.kept["weight"][0, index].float()
        if self.matched:
            # (draws, pixels) and (draws × 2, pixels): one of the draws.
            chosen = draw.below(len(self.kept["truth"]))
            rows = (2 * chosen[:, None] + torch.arange(2, device=self.device))[..., None, None]
            views, found = (self.kept[kind][rows, index[:, None]].float() for kind in ("taken", "matched"))
            maps = [self.kept["truth"][chosen[:, None, None], index].float(), weight, *found.unbind(1)]
        else:
            both = self.kept["views"][:, index].unflatten(0, (2, 2)).movedim(2, 0)
            views, less = captured(both, self.noise, draw, self.crosstalk)
            maps = [self.kept["disparity"][0, index].float() * less[:, 0], weight]
        # In a mirror left is right: the disparity stays.
        views = torch.where(mirrored, views.flip(1), views)
        return views, torch.stack(maps, dim=1)


def shown(views, draw):
    """Roots of views (n, 2, H, W) with what evening leaves of shading, and of their tone."""
    # Up to 4 % from side to side.
    ramp = torch.linspace(-1, 1, views.shape[-1], device=views.device)
    shading = 1 + draw.normal(0.015, 2) * ramp[:, None] + draw.normal(0.015, 2) * ramp
    views = views * shading * (1 + draw.normal(0.01, 2))
    # Roots of linear numbers; a fifth as if a tone curve had not been undone quite, in 8 bits.
    toned = draw.chance(0.2)
    roots = views.clamp(min=1e-6) ** torch.where(toned, draw.uniform(0.35, 0.7), 0.5)
    roots = torch.where(toned, (roots * 255).round() / 255, roots)
    white = torch.quantile(roots.mean(dim=1).flatten(1), 0.99, dim=1).reshape(-1, 1, 1, 1)
    # The white of the whole picture may lie in another crop.
    return roots / white * 10 ** draw.uniform(-0.15, 0.02)
