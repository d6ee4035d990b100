"""The largest picture, for files of pictures and for calibrations, which say how large pictures will be."""

from __future__ import annotations

MOST_PIXELS = 64_000_000  # more than cameras on a craft have, and 200 MB of memory
BOUND = f"at most {MOST_PIXELS // 1_000_000} million pixels are taken"


def is_too_large(size: tuple[int, int]) -> bool:
    """Return whether a picture of this width and height (px) has more pixels than that."""
    return size[0] * size[1] > MOST_PIXELS
