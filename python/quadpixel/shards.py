"""WebDataset shards of ``qpgen export --layout webdataset`` without the webdataset package."""

import json
import os
import tarfile

from . import paths
from .dataset import decode


def iterate_shard(path, items=None):
    """The samples of one tar shard in order, each as `decode` gives it.

    Members are ``KEY.EXT``; those of one sample stand side by side, and KEY is the name up to its first dot.
    """
    key, files = None, {}
    with tarfile.open(path, "r|") as tar:
        for member in tar:
            own, _, name = member.name.partition(".")
            if files and own != key:
                yield decode(files, items)
                files = {}
            key = own
            if not member.isreg() or member.size > paths.LARGEST_BYTES:
                raise ValueError(f"{path}: {member.name} is no plain file of at most {paths.LARGEST_BYTES} bytes")
            content = tar.extractfile(member)
            files[name] = content.read() if content else b""
    if files:
        yield decode(files, items)


def iterate_shards(index, items=None):
    """The samples of all shards that a wids index (``train.json``) lists."""
    folder = os.path.dirname(os.fspath(index))
    with open(index, "rb") as file:
        shards = json.load(file)["shardlist"]
    for shard in shards:
        yield from iterate_shard(paths.inside(folder or ".", shard["url"]), items)
