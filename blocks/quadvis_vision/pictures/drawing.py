"""Marks and words on pictures: points at fractions of a pixel, text that is legible on any background."""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SHIFT = 4  # OpenCV draws at fractions of a pixel when coordinates are given in sixteenths
Colour = tuple[int, int, int]  # blue-green-red
PLATE: Colour = (32, 32, 32)
_FARTHEST = 1e4  # px: the limit of coordinates; it lies outside every picture and fits into whole numbers


def sixteenths(pixels: Floats, zoom: float) -> NDArray[np.int32]:
    """Return pixels (n, 2) of a picture in sixteenths of a pixel of the same picture, enlarged `zoom` times.

    NaN and points far outside become points just outside every picture.
    """
    bounded = np.nan_to_num(pixels, nan=-_FARTHEST).clip(-_FARTHEST, _FARTHEST)
    # The centre of pixel 0 lies half a pixel inside the picture, at any size.
    enlarged = (bounded + 0.5) * zoom - 0.5
    return np.asarray(np.rint(enlarged * 2**SHIFT), dtype=np.int32)


def write(canvas: Any, text: str, at: tuple[int, int], colour: Colour, scale: float) -> None:
    """Write a line of text into the canvas with its lower left corner at (x, y)."""
    import cv2

    cv2.putText(canvas, text, at, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv2.LINE_AA)


def write_on_plate(canvas: Any, text: str, at: tuple[int, int], colour: Colour, scale: float) -> None:
    """Write a line of text on a dark plate, which makes the text legible on any picture."""
    import cv2

    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    x, y = at
    cv2.rectangle(canvas, (x - 3, y - height - 3), (x + width + 2, y + below // 2 + 2), PLATE, cv2.FILLED)
    write(canvas, text, at, colour, scale)


def width_of(text: str) -> float:
    """Return the width of a line of text at scale 1, in pixels."""
    import cv2

    return float(cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, 1)[0][0])


def is_picture(pixels: object) -> TypeGuard[Picture]:
    """Return whether a value is a uint8 array (height, width, 3) with at least one pixel."""
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8 or pixels.ndim != 3:
        return False
    return bool(pixels.size and pixels.shape[2] == 3)
