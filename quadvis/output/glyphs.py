"""The curves inside of blocks that are drawn by a symbol: a saturation, a relay, a sine."""

from __future__ import annotations

import math
from collections.abc import Iterator

from quadvis.block.symbol import CURVES
from quadvis.output import svg
from quadvis.output.drawn import INK

WIDTH, HEIGHT = 42.0, 28.0  # pixels
AXES = "#9aa0a8"
Line = tuple[tuple[float, float], ...]


def _sampled(height: float, sweep: float) -> Line:
    """Return a wave from -1 to 1 whose frequency grows by a factor."""
    instants = [step / 40 for step in range(41)]
    return tuple((2 * t - 1, height * math.sin(2 * math.pi * (t + sweep * t * t))) for t in instants)


def _stairs(heights: tuple[float, ...]) -> Line:
    """Return a line that stands still at each height."""
    wide = 2 / len(heights)
    corners = ((place * wide - 1, height) for place, height in enumerate(heights))
    return tuple(point for x, y in corners for point in ((x, y), (x + wide, y)))


_NOISE = (0.1, 0.7, -0.4, 0.3, -0.8, 0.2, 0.9, -0.2, -0.6, 0.5, -0.1, 0.6, -0.7, 0.4, 0.0)
_PEAKS = ((-0.8, -0.3), (-0.4, 0.9), (0.0, -0.1), (0.4, -0.5), (0.8, -0.7))
# From -1 to 1 to the right and up; the first lines with axes behind them are characteristics.
_CURVES: dict[str, tuple[Line, ...]] = {
    "saturation": (((-1.0, -0.7), (-0.45, -0.7), (0.45, 0.7), (1.0, 0.7)),),
    "dead_zone": (((-1.0, -0.9), (-0.35, 0.0), (0.35, 0.0), (1.0, 0.9)),),
    "relay": (((-1.0, -0.7), (0.35, -0.7), (0.35, 0.7)), ((1.0, 0.7), (-0.35, 0.7), (-0.35, -0.7))),
    "backlash": (((-1.0, -0.8), (0.1, -0.8), (1.0, 0.8), (-0.1, 0.8), (-1.0, -0.8)),),
    "quantizer": (_stairs((-0.9, -0.45, 0.0, 0.45, 0.9)),),
    "friction": (((-1.0, -0.9), (0.0, -0.45), (0.0, 0.45), (1.0, 0.9)),),
    "lookup": (((-1.0, -0.8), (-0.5, -0.4), (0.0, 0.4), (0.5, 0.55), (1.0, 0.9)),),
    "rate_limiter": (((-1.0, -0.7), (-0.7, -0.7), (-0.1, 0.7), (0.3, 0.7), (0.9, -0.7)),),
    "step": (((-1.0, -0.7), (-0.1, -0.7), (-0.1, 0.7), (1.0, 0.7)),),
    "ramp": (((-1.0, -0.7), (-0.4, -0.7), (1.0, 0.8)),),
    "sine": (_sampled(0.8, 0.0),),
    "chirp": (_sampled(0.8, 2.0),),
    "pulse": (_stairs((-0.7, 0.7, 0.7, -0.7, -0.7, 0.7, 0.7, -0.7)),),
    "sequence": (((-1.0, -0.7), (-0.4, 0.7), (-0.4, -0.7), (0.3, 0.7), (0.3, -0.7), (1.0, 0.7)),),
    "noise": (tuple((place / 7 - 1, height) for place, height in enumerate(_NOISE)),),
    "binary_noise": (_stairs((0.7, -0.7, -0.7, 0.7, -0.7, 0.7, 0.7, 0.7, -0.7, 0.7)),),
    "spectrum": tuple(((x, -0.9), (x, height)) for x, height in _PEAKS),
    "switch": (
        ((-1.0, 0.7), (-0.5, 0.7)),
        ((-1.0, -0.7), (-0.5, -0.7)),
        ((-0.5, 0.7), (0.5, 0.0), (1.0, 0.0)),
    ),
    "clock": (((0.0, 0.65), (0.0, 0.0), (0.3, -0.3)),),
}  # fmt: skip
_CHARACTERISTICS = ("backlash", "dead_zone", "friction", "lookup", "quantizer", "relay", "saturation")
_CONTACTS = ((-0.5, 0.7), (-0.5, -0.7), (0.5, 0.0))
assert set(_CURVES) == set(CURVES)


def glyph(name: str, x: float, y: float) -> Iterator[str]:
    """Yield the elements of a curve in the rectangle `WIDTH` x `HEIGHT` whose upper left corner is (x, y)."""

    def at(point: tuple[float, float]) -> tuple[float, float]:
        return x + WIDTH / 2 * (1 + 0.94 * point[0]), y + HEIGHT / 2 * (1 - 0.94 * point[1])

    if name in _CHARACTERISTICS:
        for axis in (((-1.0, 0.0), (1.0, 0.0)), ((0.0, -1.0), (0.0, 1.0))):
            yield svg.element("polyline", points=svg.points(map(at, axis)), fill="none", stroke=AXES)
    if name == "clock":
        (cx, cy), r = at((0.0, 0.0)), HEIGHT / 2 - 1
        yield svg.element("circle", cx=cx, cy=cy, r=r, fill="none", stroke=INK, stroke_width=1.4)
    for line in _CURVES[name]:
        corners = svg.points(map(at, line))
        yield svg.element(
            "polyline", points=corners, fill="none", stroke=INK, stroke_width=1.5, stroke_linejoin="round"
        )
    if name == "switch":
        for cx, cy in map(at, _CONTACTS):
            yield svg.element("circle", cx=cx, cy=cy, r=2.2, fill=INK)
