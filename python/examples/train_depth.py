"""Trains a tiny network for a few steps: x_L - x_R from the left and right half of the pupil, then metres.

    python train_depth.py DATASET [STEPS]

A start, not a result: a few thousand parameters, and no augmentation.
"""

import sys

import numpy as np

import quadpixel


def prepare(sample):
    """Two halves as channels, brightness taken out, and the truth with its mask."""
    left, right = quadpixel.halves(sample["views"], sample["meta"])
    pair = np.concatenate([left, right], axis=-1)
    pair = pair / (pair.mean() + 1e-6) - 1.0
    valid = sample["valid"]
    return {
        "pair": pair.transpose(2, 0, 1).astype(np.float32),
        "shift": np.where(valid, sample["left_right"], 0.0).astype(np.float32)[None],
        "valid": valid[None],
    }


def main(root, steps=60):
    data = quadpixel.Dataset(root, items=("views", "disparity", "depth", "valid"))
    try:
        import torch
    except ImportError:
        print(f"{len(data)} samples can be read; torch is not installed, so nothing is trained (pip install torch)")
        return
    torch.manual_seed(0)

    def layer(inputs, outputs, dilation=1):
        return torch.nn.Conv2d(inputs, outputs, 3, padding=dilation, dilation=dilation)

    network = torch.nn.Sequential(
        layer(6, 24), torch.nn.ReLU(), layer(24, 24, 2), torch.nn.ReLU(), layer(24, 24, 4), torch.nn.ReLU(), layer(24, 1)
    )
    loader = torch.utils.data.DataLoader(
        quadpixel.Dataset(root, items=data.items, transform=prepare), batch_size=2, shuffle=True
    )
    optimizer = torch.optim.Adam(network.parameters(), lr=3e-3)

    def loss_of(batch):
        error = (network(batch["pair"]) - batch["shift"]).abs()
        return error[batch["valid"]].mean()

    def mean_loss():
        with torch.no_grad():
            return float(sum(loss_of(batch) for batch in loader) / len(loader))

    before, step = mean_loss(), 0
    while step < steps:
        for batch in loader:
            optimizer.zero_grad()
            loss = loss_of(batch)
            loss.backward()
            optimizer.step()
            step += 1
    after = mean_loss()
    print(f"mean |error| of x_L - x_R: {before:.3f} px before, {after:.3f} px after {step} steps")
    sample = data[0]
    with torch.no_grad():
        shift = network(torch.from_numpy(prepare(sample)["pair"])[None])[0, 0].numpy()
    depth = quadpixel.depth_from_disparity(shift, sample["camera"])
    truth = sample["depth"]
    known = sample["valid"] & np.isfinite(depth) & np.isfinite(truth)
    error = np.median(np.abs(depth - truth)[known] / truth[known])
    print(f"sample {sample['id']}: median depth error {100 * error:.1f} %")
    if not after < before:
        sys.exit("the loss did not fall")


if __name__ == "__main__":
    main(sys.argv[1], *(int(n) for n in sys.argv[2:3]))
