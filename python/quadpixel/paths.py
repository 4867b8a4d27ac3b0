"""Names that come from a dataset's files, and the files that they lead to: plain ones inside the dataset.

Their sizes are held to the descriptions.
"""

import os
import re
import stat

_PLAIN = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}")
#: the largest file that is read, bytes
LARGEST_BYTES = 8 << 30


def plain_name(name, what):
    """``name`` if it is a plain file name that leads nowhere else; else ValueError."""
    if not isinstance(name, str) or not _PLAIN.fullmatch(name):
        raise ValueError(f"{what} is {name!r}; allowed: 1 to 100 of the characters A-Z a-z 0-9 . _ -, not beginning with a dot")
    return name


def inside(root, *names):
    """The path of a plain file below ``root``.

    ValueError for a name or link that leads out of it, and for a pipe or device.
    """
    path = os.path.join(root, *(plain_name(name, f"a name in {root}") for name in names))
    home = os.path.realpath(root)
    if os.path.commonpath([home, os.path.realpath(path)]) != home:
        raise ValueError(f"{path}: a link leads out of {root}")
    kind = os.stat(path)
    if not stat.S_ISREG(kind.st_mode):
        raise ValueError(f"{path}: no plain file")
    if kind.st_size > LARGEST_BYTES:
        raise ValueError(f"{path}: {kind.st_size} bytes; allowed: at most {LARGEST_BYTES}")
    return path


def read(root, *names):
    """The content of that file."""
    with open(inside(root, *names), "rb") as file:
        return file.read()
