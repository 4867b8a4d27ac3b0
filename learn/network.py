"""The network: two views in, disparity and its spread out, for every second pixel."""

import torch
from torch import nn
from torch.nn import functional

#: Channels at a half, a quarter ... of the views' resolution.
WIDTHS = (24, 32, 48, 64, 96, 128)
#: Contrast that counts as none, parts of white's root.
FLOOR = 0.004


def local_mean(x):
    """Under two windows of 11 px, one after the other: nearly a Gaussian of 4.5 px."""
    for _ in range(2):
        x = functional.avg_pool2d(x, 11, stride=1, padding=5, count_include_pad=False)
    return x


def features(views):
    """What the network sees of (N, 2, H, W) roots of views whose 99th percentile is 1: (N, 4, H, W).

    Texture of the sum and of the difference over the sum's local contrast, the contrast's logarithm, and the sum.
    """
    half_sum = 0.5 * (views[:, :1] + views[:, 1:])
    half_difference = 0.5 * (views[:, :1] - views[:, 1:])
    texture = half_sum - local_mean(half_sum)
    unlike = half_difference - local_mean(half_difference)
    contrast = torch.sqrt(local_mean(texture * texture) + FLOOR * FLOOR)
    return torch.cat([texture / contrast, 4.0 * unlike / contrast, 0.5 * torch.log(contrast) + 1.5, half_sum], dim=1)


class Block(nn.Module):
    """Two convolutions beside an identity; the second begins as zero, so that a deep network begins as a shallow one."""

    def __init__(self, width):
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, padding=1)
        self.second = nn.Conv2d(width, width, 3, padding=1)
        nn.init.zeros_(self.second.weight)
        nn.init.zeros_(self.second.bias)

    def forward(self, x):
        return x + self.second(functional.relu(self.first(functional.relu(x))))


class Network(nn.Module):
    """A U-Net on the features, two by two pixels to a place.

    Takes (N, 2, H, W), H and W multiples of 64. Gives (N, 2, H/2, W/2): x_L - x_R in px of the views at pixel (2i, 2j),
    and the logarithm of the mean absolute error to expect, px. With `matched` it also takes such numbers, as matching by
    kernels found them, and answers for both: the mean of its own answer and that one by 1/σ², with another σ. Begun
    with the weights of a network without (`widened`), that is what the program makes of such a network and matching.
    """

    def __init__(self, widths=WIDTHS, matched=False):
        super().__init__()
        self.enter = nn.Conv2d(18 if matched else 16, widths[0], 3, padding=1)
        self.down = nn.ModuleList(
            nn.Conv2d(a, b, 3, stride=2, padding=1) for a, b in zip(widths, widths[1:], strict=False)
        )
        self.left = nn.ModuleList(Block(w) for w in widths)
        self.join = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in zip(widths, widths[1:], strict=False))
        self.right = nn.ModuleList(Block(w) for w in widths[:-1])
        self.leave = nn.Conv2d(widths[0], 3 if matched else 2, 3, padding=1)

    @staticmethod
    def of(weights):
        """A network of kept weights, as wide as they are."""
        widths = [w.shape[0] for n, w in weights.items() if n.startswith("left.") and n.endswith("first.weight")]
        network = Network(widths, matched=weights["enter.weight"].shape[1] == 18)
        network.load_state_dict(weights)
        return network

    def widened(self, weights):
        """Takes the weights of a network without `matched`, which stays unheard at first, as is the third answer."""
        own = {name: torch.zeros_like(w) for name, w in self.state_dict().items()}
        for name, weight in weights.items():
            own[name][tuple(slice(n) for n in weight.shape)] = weight
        self.load_state_dict(own)

    def forward(self, views, matched=None):
        seen = functional.pixel_unshuffle(features(views), 2)
        if matched is not None:
            # Within 8 px, by operators that the program knows.
            bounded = functional.relu(matched[:, :1] + 8) - functional.relu(matched[:, :1] - 8) - 8
            seen = torch.cat([seen, 0.5 * bounded, 0.5 * matched[:, 1:] + 1.0], dim=1)
        x = self.left[0](self.enter(seen))
        kept = [x]
        for down, block in zip(self.down, self.left[1:], strict=True):
            x = block(down(functional.relu(x)))
            kept.append(x)
        x = kept.pop()
        for join, block in zip(reversed(self.join), reversed(self.right), strict=True):
            finer = functional.interpolate(join(x), scale_factor=2.0, mode="bilinear", align_corners=False)
            x = block(finer + kept.pop())
        told = self.leave(functional.relu(x))
        if matched is None:
            return told
        # 1/σ² over the sum of both, its share of the mean; the logarithms of σ are blended alike, and put right.
        share = torch.sigmoid(2.0 * (matched[:, 1:] - told[:, 1:2]))
        return matched + share * (told[:, :2] - matched) + torch.cat([0 * share, told[:, 2:]], dim=1)
