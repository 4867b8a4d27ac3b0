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


#: Weights of R, G and B in a grey picture: luminance of ITU-R BT.709.
LUMINANCE = (0.2126, 0.7152, 0.0722)


def channel_disparity(sample, channel):
    """(dx, dy) of each view against the sum in one channel, px, (m*n, H, W, 2) float32 (SPEC.md, "Channel").

    ``channel`` is 'R', 'G', 'B' or 'grey': a picture sum(LUMINANCE * view) of a scene without colour, for which ``sample`` needs
    ``shading`` (or else each channel counts as if it were as bright in every view). ``sample`` holds ``disparity`` and ``shifts``.
    """
    green, differ = sample["disparity"], sample["channel_shifts"]
    if channel not in ("R", "G", "B", "grey"):
        raise ValueError(f"channel is {channel!r}; allowed: 'R', 'G', 'B', 'grey'")
    if differ is None or channel == "G":
        return green
    if channel != "grey":
        return green + differ[channel][:-1]
    light = sample.get("shading")
    if light is None:
        light = np.ones(green.shape[:3] + (3,), np.float32)
    view = np.zeros(green.shape, np.float64)
    whole = np.zeros(green.shape[1:], np.float64)
    for index, (name, weight) in enumerate(zip("RGB", LUMINANCE)):
        own = green + (differ[name][:-1] if name in differ else 0.0)
        lateral = differ[name][-1] if name in differ else 0.0
        share = weight * light[..., index].astype(np.float64)
        view += share[..., None] * (own + lateral)
        whole += share.sum(axis=0)[..., None] * lateral
    total = (np.asarray(LUMINANCE) * light).sum(axis=-1, dtype=np.float64)
    return (view / total[..., None] - whole / total.sum(axis=0)[..., None]).astype(np.float32)


def _at_pixels(nodes, camera):
    """Values at every pixel of the window from those at the nodes (rows, columns, ...) that span it from edge to edge."""

    def along(pixels, count):
        # A place between two nodes is their linear mixture.
        place = (np.arange(pixels) + 0.5) / pixels * (count - 1)
        first = np.minimum(place.astype(int), count - 2)
        return first, place - first

    rest = (1,) * (nodes.ndim - 2)
    (j, fy), (i, fx) = along(camera["height_px"], nodes.shape[0]), along(camera["width_px"], nodes.shape[1])
    fx, fy = fx.reshape((1, -1) + rest), fy.reshape((-1, 1) + rest)
    across = nodes[:, i] + fx * (nodes[:, i + 1] - nodes[:, i])
    return across[j] + fy * (across[j + 1] - across[j])


def depth_from_disparity(shift_px, camera, direction="left_right", channel="G"):
    """Depth z, metres from the first lens vertex, of a map (H, W) of the disparity of two halves, px, aberrations included.

    Undoes D = c0 + c1 t + c2 t^2, t = 1/(z + p), of ``camera.json`` (SPEC.md, "Metres from disparity") within 0.1 % of t.
    ``direction``: 'left_right' (x_L - x_R) or 'top_bottom' (y_T - y_B); ``channel``: 'R', 'G', 'B' or 'grey'. The disparity is
    that of centroids. inf at infinity and beyond, NaN where no distance has it.
    """
    curves = camera["disparity"][direction]
    named = [curve for curve in curves if curve["channel"] == channel] or (curves if len(curves) == 1 else [])
    if not named:
        raise ValueError(f"the camera has no curve of {direction} for {channel!r}: {[curve['channel'] for curve in curves]}")
    curve = named[0]
    nodes = np.reshape(curve["coefficients"], (curve["rows"], curve["columns"], 3))
    c0, c1, c2 = np.moveaxis(_at_pixels(nodes, camera), -1, 0)
    shift_px = np.asarray(shift_px, np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(c1**2 - 4.0 * c2 * (c0 - shift_px))
        inverse = 2.0 * (shift_px - c0) / (c1 + np.sign(c1) * root)
        z = 1.0 / inverse - camera["intrinsics"]["pinhole_behind_vertex_m"]
    return np.where(np.isnan(inverse), np.nan, np.where((inverse <= 0.0) | (z <= 0.0), np.inf, z))


def disparity_ratio(camera, direction="left_right"):
    """Ratio of disparity to circle of confusion at every pixel, (H, W) float64, of a camera (``camera.json``).

    ``direction`` is 'left_right' or 'top_bottom'. A constant of lens and response: nothing of a scene is in it.
    """
    field = camera["disparity_ratio"][direction]
    if field is None:
        raise ValueError(f"the camera has no ratio of disparity to coc for {direction}: the pixel is not parted that way")
    nodes = np.reshape(field["values"], (field["rows"], field["columns"]))
    return _at_pixels(nodes, camera)


def depth_from_left_right(shift_px, camera, ratio=None):
    """Depth z, metres from the first lens vertex, of a left-right disparity x_L - x_R in px (SPEC.md, "Metres from disparity").

    ``camera`` is the sample's ``camera.json``. ``ratio`` is disparity over circle of confusion; None: the camera's own
    (`disparity_ratio`), for a map of the whole window, (H, W). inf where the disparity is that of infinity or beyond, NaN where
    the ratio is not above 0. An approximation of one pinhole: `depth_from_disparity` knows the lens's aberrations.
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
