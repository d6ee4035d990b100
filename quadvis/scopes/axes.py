"""Axes with round numbers: 1, 2 or 5 times a power of ten apart."""

from __future__ import annotations

import math
from typing import NamedTuple

LARGEST = 1e300  # end of an axis: a span must be a number, too
FINEST = 1e-12  # span of an axis against its values


class TextAxis(NamedTuple):
    """An axis from ``least`` to ``greatest``, with round numbers as multiples of ``step``."""

    least: float
    greatest: float
    step: float

    @property
    def marks(self) -> list[float]:
        """The round numbers on the axis."""
        first, last = math.ceil(self.least / self.step - 1e-9), math.floor(self.greatest / self.step + 1e-9)
        return [number * self.step for number in range(first, last + 1)]

    def text(self, mark: float) -> str:
        """Return a round number with as many decimals as its neighbours."""
        return number_text(mark, self.step)

    def place(self, value: float) -> float:
        """Return where a value lies: 0 at the least, 1 at the greatest."""
        return (value - self.least) / (self.greatest - self.least)


def number_text(value: float, step: float) -> str:
    """Return a number with the decimals that tell it from one that is ``step`` away."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    if decimals > 6 or abs(value) >= 1e7:
        digits = max(0, math.floor(math.log10(max(abs(value), step) / step) + 1e-9))
        return f"{value:.{digits}e}" if abs(value) > step * 1e-6 else "0"
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def round_step(span: float, most: int) -> float:
    """Return the least round step of which a span has at most ``most``."""
    rough = span / max(1, most)
    power = 10.0 ** math.floor(math.log10(rough))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough * (1 - 1e-9))


def round_axis(least: float, greatest: float, most: int) -> TextAxis:
    """Return an axis that reaches from one round number to another and holds all values between two."""
    least, greatest = _apart(least, greatest)
    step = round_step(greatest - least, most)
    return TextAxis(
        math.floor(least / step + 1e-9) * step,
        math.ceil(greatest / step - 1e-9) * step,
        step,
    )


def exact_axis(least: float, greatest: float, most: int) -> TextAxis:
    """Return an axis with just these ends."""
    if greatest - least <= 0.0:
        greatest = least + 1.0
    return TextAxis(least, greatest, round_step(greatest - least, most))


def _apart(least: float, greatest: float) -> tuple[float, float]:
    """Return the ends of an axis that holds two values: around them if they are the same but for rounding."""
    least, greatest = (min(max(end, -LARGEST), LARGEST) for end in (least, greatest))
    if greatest - least > max(abs(least), abs(greatest)) * FINEST + 1 / LARGEST:
        return least, greatest
    half = abs(least) / 2 or 1.0
    return least - half, greatest + half
