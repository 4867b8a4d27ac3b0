"""Sub-pixels, halves of the pupil, and metres from disparity."""

import numpy as np


def subpixel_counts(meta):
    """Columns and rows of sub-pixels of a pixel."""
    subpixels = meta["sensor"]["subpixels"]
    if isinstance(subpixels, dict):  # of files written before they became a text
        return subpixels["columns"], subpixels["rows"]
    columns, rows = subpixels.split("x")
    return int(columns), int(rows)


def subpixel_names(columns, rows):
    """Names of the sub-pixels in stored order: B A D C for 2x2, L R for 2x1, T B for 1x2, else r{row}c{column}."""
    known = {(2, 2): ["B", "A", "D", "C"], (2, 1): ["L", "R"], (1, 2): ["T", "B"]}
    return known.get((columns, rows)) or [f"r{j}c{i}" for j in range(rows) for i in range(columns)]


def mosaic_channels(meta):
    """Channel (0: R, 1: G, 2: B) of each place of a sample's ``mosaic``, (nH, mW) int: one colour a microlens."""
    if "mosaic" not in meta:
        raise ValueError(f"sample {meta['id']} has no mosaic")
    square = np.array(["rgb".index(colour) for colour in meta["mosaic"]["pattern"]]).reshape(2, 2)
    columns, rows = subpixel_counts(meta)
    y = np.arange(meta["sensor"]["height_px"] * rows) // rows % 2
    x = np.arange(meta["sensor"]["width_px"] * columns) // columns % 2
    return square[y[:, None], x]


def side_members(side, columns, rows):
    """Indices, in stored order, of the sub-pixels on a ``side``: 'L', 'R', 'T' or 'B' of the stored pixel.

    The stored left sees the left half of the pupil, as the photographer looks. An odd number's middle belongs to neither side.
    """
    half_m, half_n = columns // 2, rows // 2
    inside = {
        "L": lambda i, j: i < half_m,
        "R": lambda i, j: i >= columns - half_m,
        "T": lambda i, j: j < half_n,
        "B": lambda i, j: j >= rows - half_n,
    }[side]
    return [j * columns + i for j in range(rows) for i in range(columns) if inside(i, j)]


def halves(views, meta, sides="LR"):
    """The views of two (or more) sides of the pupil, each the sum of its sub-pixels: a tuple of (H, W, 3) float32, linear.

    ``views`` is (m*n, H, W, 3) in stored order.
    """
    members = [side_members(side, *subpixel_counts(meta)) for side in sides]
    if not all(members):
        raise ValueError(f"a pixel of {subpixel_counts(meta)[0]} x {subpixel_counts(meta)[1]} sub-pixels has no halves {sides}")
    return tuple(views[own].sum(axis=0, dtype=np.float32) for own in members)


def left_right(disparity, meta):
    """x_L - x_R, px, (H, W) float32: positive for points nearer than the focus.

    ``disparity`` is (m*n, H, W, 2): each view's (dx, dy) in stored order.
    """
    left, right = (disparity[side_members(s, *subpixel_counts(meta)), ..., 0] for s in "LR")
    if not len(left):
        raise ValueError("a pixel of one column has no left and right")
    return (left.mean(axis=0) - right.mean(axis=0)).astype(np.float32)


def disparity_ratio(camera, direction="left_right"):
    """Ratio of disparity to circle of confusion at every pixel, (H, W) float64, of a camera (``camera.json``).

    ``direction`` is 'left_right' or 'top_bottom'. A constant of lens and response: nothing of a scene is in it.
    """
    field = camera["disparity_ratio"][direction]
    if field is None:
        raise ValueError(f"the camera has no ratio of disparity to coc for {direction}: the pixel is not parted that way")
    nodes = np.reshape(field["values"], (field["rows"], field["columns"]))

    def along(pixels, count):
        # The nodes span the window from edge to edge; a place between two of them is their linear mixture.
        place = (np.arange(pixels) + 0.5) / pixels * (count - 1)
        first = np.minimum(place.astype(int), count - 2)
        return first, place - first

    (j, fy), (i, fx) = along(camera["height_px"], field["rows"]), along(camera["width_px"], field["columns"])
    across = nodes[:, i] + fx * (nodes[:, i + 1] - nodes[:, i])
    return across[j] + fy[:, None] * (across[j + 1] - across[j])


def depth_from_left_right(shift_px, camera, ratio=None):
    """Depth z, metres from the first lens vertex, of a left-right disparity x_L - x_R in px (SPEC.md, "Metres from disparity").

    ``camera`` is the sample's ``camera.json``. ``ratio`` is disparity over circle of confusion; None: the camera's own
    (`disparity_ratio`), for a map of the whole window, (H, W). inf where the disparity is that of infinity or beyond, NaN where
    the ratio is not above 0. The disparity of the lens's aberrations is not taken off.
    """
    shift_px = np.asarray(shift_px)
    if ratio is None:
        ratio = disparity_ratio(camera)
        if shift_px.shape != ratio.shape:
            raise ValueError(f"shift_px is {shift_px.shape}; allowed without a ratio: the whole window, {ratio.shape}")
    ratio = np.where(np.asarray(ratio) > 0.0, ratio, np.nan)
    pinhole = camera["intrinsics"]
    behind = pinhole["pinhole_behind_vertex_m"]
    focus = camera["focus"]["distance_m"]
    in_focus = 0.0 if focus is None else 1.0 / (focus + behind)
    inverse = in_focus + shift_px / (ratio * pinhole["fx_px"] * pinhole["entrance_pupil_diameter_m"])
    with np.errstate(divide="ignore"):
        return np.where(inverse <= 0.0, np.inf, 1.0 / np.maximum(inverse, 1e-12) - behind)
