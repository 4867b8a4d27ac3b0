"""Reads the shards of `qpgen export DATASET --layout webdataset -o SHARDS`: python read_shards.py SHARDS/train.json

With the webdataset package the same decoder serves its pipeline; without it, quadpixel's own reader does.
"""

import json
import os
import sys

import quadpixel


def samples(index):
    try:
        import webdataset
    except ImportError:
        return quadpixel.iterate_shards(index, items=("views", "depth", "disparity", "valid"))
    folder = os.path.dirname(index)
    with open(index, "rb") as file:
        urls = [os.path.join(folder, shard["url"]) for shard in json.load(file)["shardlist"]]
    return webdataset.WebDataset(urls, shardshuffle=False).map(quadpixel.decode)


def main(index):
    count = 0
    for sample in samples(index):
        valid = sample["valid"]
        shift = sample["left_right"][valid]
        print(f"{sample['id']}: views {sample['views'].shape}, x_L - x_R {shift.min():+.2f} to {shift.max():+.2f} px")
        count += 1
    print(f"{count} samples")


if __name__ == "__main__":
    main(sys.argv[1])
