"""A picture as text: two pixels a character in colour, or eight dots a character without."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

UPPER_HALF, BRAILLE = "\u2580", 0x2800
RESET = "\x1b[0m"
# The bit of each of the eight dots of a braille character, four rows of two.
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])


def in_colour(pixels: NDArray[np.uint8], columns: int, rows: int) -> str:
    """Return a picture (height, width, 3; blue-green-red) as half blocks in 24 bits of colour."""
    small = _fitted(pixels, columns, 2 * rows, 2)
    lines = []
    for upper, lower in zip(small[::2], small[1::2], strict=True):
        cells = []
        for (b, g, r), (b2, g2, r2) in zip(upper.tolist(), lower.tolist(), strict=True):
            cells.append(f"\x1b[38;2;{r};{g};{b};48;2;{r2};{g2};{b2}m{UPPER_HALF}")
        lines.append("".join(cells) + RESET)
    return "\n".join(lines)


def in_dots(pixels: NDArray[np.uint8], columns: int, rows: int) -> str:
    """Return a picture as braille characters; grey comes by error diffusion (Floyd and Steinberg, 1976)."""
    small = _fitted(pixels, 2 * columns, 4 * rows, 4)
    dots = _diffused(small.mean(axis=2))
    height, width = dots.shape
    width -= width % 2
    cells = dots[:, :width].reshape(height // 4, 4, width // 2, 2).transpose(0, 2, 1, 3)
    codes = BRAILLE + (cells * DOTS).sum(axis=(2, 3))
    return "\n".join("".join(map(chr, line)) for line in codes.tolist())


def _fitted(pixels: NDArray[np.uint8], width: int, height: int, multiple: int) -> Any:
    """Return a picture that fits into a size, in its shape; its height is a multiple."""
    import cv2

    scale = min(width / pixels.shape[1], height / pixels.shape[0])
    wide = max(2, round(pixels.shape[1] * scale))
    high = max(multiple, round(pixels.shape[0] * scale / multiple) * multiple)
    return cv2.resize(pixels, (wide, high), interpolation=cv2.INTER_AREA)


def _diffused(grey: NDArray[np.float64]) -> NDArray[np.bool_]:
    left = np.pad(grey, ((0, 1), (1, 1)))
    found = np.zeros(grey.shape, bool)
    for row in range(grey.shape[0]):
        for column in range(grey.shape[1]):
            value = left[row, column + 1]
            found[row, column] = bright = value > 127
            error = value - 255.0 * bright
            left[row, column + 2] += error * 7 / 16
            left[row + 1, column : column + 3] += error * np.array([3, 5, 1]) / 16
    return found
