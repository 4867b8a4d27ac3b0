"""Camera-like pictures taken back to linear values."""

from typing import Any

import numpy as np
import numpy.typing as npt


def linear_from_codes(codes: npt.ArrayLike, meta: Any, views: bool = False) -> npt.NDArray[np.float32]:
    """Linear values of the 8-bit codes of a camera-like picture: tone curve, sRGB, colour matrix, white balance and gain undone.

    codes   (..., 3), 0 to 255: ``camera_picture`` or ``camera_views`` of a sample, or what a network made of one
    meta    the sample's ``meta.json``, of which ``camera_pictures`` says how the codes came about
    views   whether they are of views, which are brighter by the number of sub-pixels

    Returns float32 on the scale of the linear files. What was cut at black or at white (codes 0 and 255) stays cut.
    """
    how = meta.get("camera_pictures")
    if how is None:
        raise ValueError(f"sample {meta.get('id')!r} has no camera-like pictures: meta.json has no camera_pictures")
    development = how["development"]
    x, y = np.array(development["tone_curve"], dtype=np.float64).T
    if not (len(x) >= 2 and (np.diff(x) > 0).all() and (np.diff(y) > 0).all()):
        raise ValueError(f"tone_curve is {development['tone_curve']}; allowed: points that rise in both numbers")
    srgb = np.interp(np.asarray(codes, dtype=np.float64) / 255.0, y, x)
    light = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    balanced = light @ np.linalg.inv(np.array(development["matrix"], dtype=np.float64)).T
    factors = development["gain"] * np.array(development["white_balance"]) * (how["view_gain"] if views else 1.0)
    linear: npt.NDArray[np.float32] = (balanced / factors).astype(np.float32)
    return linear
