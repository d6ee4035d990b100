"""Pictures as text: colours and places are those of the picture."""

from __future__ import annotations

import re

import numpy as np
import pytest

from quadvis_vision.capture.text_picture import in_colour, in_dots


def halves() -> np.ndarray:
    """Return a picture with a red upper and a blue lower half; blue-green-red."""
    pixels = np.zeros((40, 60, 3), np.uint8)
    pixels[:20, :, 2] = 255
    pixels[20:, :, 0] = 255
    return pixels


def test_colours_stand_where_they_are() -> None:
    lines = in_colour(halves(), 30, 10).splitlines()
    assert len(lines) == 10 and all(line.count("\u2580") == 30 for line in lines)
    assert set(re.findall(r"\x1b\[([\d;]+)m", lines[0])) == {"38;2;255;0;0;48;2;255;0;0", "0"}
    assert set(re.findall(r"\x1b\[([\d;]+)m", lines[-1])) == {"38;2;0;0;255;48;2;0;0;255", "0"}


@pytest.mark.parametrize("level", [0, 64, 128, 192, 255])
def test_as_many_dots_are_lit_as_the_picture_is_bright(level: int) -> None:
    text = in_dots(np.full((64, 64, 3), level, np.uint8), 40, 16)
    cells = [ord(cell) - 0x2800 for line in text.splitlines() for cell in line]
    assert all(0 <= cell < 256 for cell in cells)
    share = sum(cell.bit_count() for cell in cells) / (8 * len(cells))
    assert share == pytest.approx(level / 255, abs=0.05)


def test_a_picture_keeps_its_shape() -> None:
    wide, high = np.zeros((30, 300, 3), np.uint8), np.zeros((300, 30, 3), np.uint8)
    assert len(in_colour(wide, 80, 24).splitlines()) == 4
    assert max(map(len, in_dots(high, 80, 24).splitlines())) <= 6
