"""Draw the pictures of a colour calibration: the circles that were found, and the colours side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from quadvis_vision.calibrate.colour_calibration import Calibrated
from quadvis_vision.calibrate.colour_search import Sighting
from quadvis_vision.detection.circles import Disc
from quadvis_vision.detection.colours import Colour
from quadvis_vision.pictures.drawing import PLATE, SHIFT, Picture, sixteenths, width_of, write, write_on_plate

WIDTH = 640  # px, the width of one picture in the drawing
ROW = 78  # px, the height of a row of colours
TITLE = 30  # px, the height of a line of words
GAP = 4  # px between pictures
WHITE = 235.0  # grey level of the ceiling beside which the stored colours are shown

_LIGHT, _DARK = (245, 245, 245), (25, 25, 25)
_GOOD, _BAD = (120, 230, 120), (90, 90, 255)  # blue-green-red
_SCALE = 0.5  # of the letters


def draw_calibration(pictures: Sequence[Picture], found: Calibrated) -> Picture:
    """Return all pictures with the circles found in them, and below them the stored colours.

    The colours of a picture are shown in the light of that picture, beside its ceiling.
    """
    evidence = found.colours.evidence
    errors = [] if evidence.errors is None else evidence.errors.tolist()
    parts = (pictures, found.sightings, found.samples.tolist(), found.names, errors, found.found)
    panels = [_panel(*of) for of in zip(*parts, strict=True)]
    columns = 2 if len(panels) in (2, 4) else min(len(panels), 3)
    rows = [_beside(panels[i : i + columns], columns) for i in range(0, len(panels), columns)]
    return np.vstack((*rows, _legend(columns * WIDTH, found)))


def _panel(
    pixels: Picture, seen: Sighting, ratios: Sequence[Colour], name: str, error: float, again: int
) -> Picture:
    """Return one picture with its circles, its name, and its colours."""
    import cv2

    zoom = WIDTH / pixels.shape[1]
    method = cv2.INTER_LINEAR if zoom > 1 else cv2.INTER_AREA
    height = max(1, round(zoom * pixels.shape[0]))
    canvas: Any = cv2.resize(np.ascontiguousarray(pixels), (WIDTH, height), interpolation=method)
    for first, second in zip(seen.discs, (*seen.discs[1:], seen.discs[0]), strict=True):
        _line(canvas, sixteenths(_edge(first, second), zoom), _LIGHT)
    for corner, disc in enumerate(seen.discs, 1):
        _line(canvas, sixteenths(_outline(disc), zoom), _LIGHT)
        x, y = (sixteenths(_beyond(disc, seen)[None], zoom)[0] >> SHIFT).tolist()
        x, y = min(max(x - 5, 4), WIDTH - 16), min(max(y + 6, 18), height - 6)
        write_on_plate(canvas, str(corner), (x, y), _LIGHT, 0.6)
    colours = [
        (f"{corner}", np.multiply(disc.ratio, light), light, ratio)
        for corner, (disc, light, ratio) in enumerate(zip(seen.discs, seen.lights, ratios, strict=True), 1)
    ]
    count = (f"{again} found again", _GOOD if again == 4 else _BAD)
    return np.vstack((canvas, _title(WIDTH, f"{name}   rms off {error:.3f}", *count), _row(WIDTH, colours)))


def _legend(width: int, found: Calibrated) -> Picture:
    white = (WHITE, WHITE, WHITE)
    colours = [
        (f"{corner} {name}", WHITE * np.array(ratio), white, ratio)
        for corner, (name, ratio) in enumerate(zip(found.colours.names, found.colours.ratios, strict=True), 1)
    ]
    title = f"stored, beside a white ceiling: blue green red; threshold {found.colours.threshold:g}"
    return np.vstack((_title(width, title, "", _LIGHT), _row(width, colours)))


def _title(width: int, words: str, result: str, colour: tuple[int, int, int]) -> Picture:
    """Return a bar with words at its left and a coloured result at its right."""
    bar = np.full((TITLE, width, 3), PLATE, dtype=np.uint8)
    room = width - 36 - _SCALE * width_of(result)
    scale = min(_SCALE, room / max(1.0, width_of(words)))
    write(bar, words, (10, 20), _LIGHT, scale)
    write(bar, result, (width - 10 - math.ceil(_SCALE * width_of(result)), 20), colour, _SCALE)
    return bar


def _row(width: int, colours: Sequence[tuple[str, Any, Colour, Colour]]) -> Picture:
    """Return a bar with four discs on their ceilings, from (label, levels, ceiling's levels, ratio)."""
    import cv2

    bar: Any = np.full((ROW, width, 3), PLATE, dtype=np.uint8)
    step, half = width // 4, (ROW - 14) // 2
    for place, (label, levels, light, ratio) in enumerate(colours):
        left, middle = 10 + place * step, (10 + place * step + half, 2 + half)
        ceiling, paint = (np.clip(part, 0, 255).tolist() for part in (light, levels))
        cv2.rectangle(bar, (left, 2), (left + 2 * half, 2 + 2 * half), ceiling, cv2.FILLED)
        cv2.circle(bar, middle, round(0.72 * half), paint, cv2.FILLED, cv2.LINE_AA)
        beside = left + 2 * half + 9
        write(bar, label, (beside, 16), _LIGHT, _SCALE)
        for line, (channel, part) in enumerate(zip("bgr", ratio, strict=True)):
            write(bar, f"{channel} {part:.3f}", (beside, 32 + 15 * line), _LIGHT, 0.42)
    return np.asarray(bar, dtype=np.uint8)


def _outline(disc: Disc) -> Any:
    """Return the outline (n, 2) in px of the ellipse with the disc's area and bend."""
    size = abs(disc.bend)
    total = 2 * disc.radius**2 / math.sqrt(1 - min(size, 0.99) ** 2)  # of the squares of the half axes
    axes = math.sqrt(total * (1 + size) / 2), math.sqrt(total * (1 - size) / 2)
    turn = np.exp(0.5j * np.angle(disc.bend))
    angle = np.linspace(0, 2 * math.pi, 72, endpoint=False)
    points = disc.centre + turn * (axes[0] * np.cos(angle) + 1j * axes[1] * np.sin(angle))
    return np.column_stack((points.real, points.imag))


def _edge(first: Disc, second: Disc) -> Any:
    """Return the ends (2, 2) in px of the line between two circles, outside their paint."""
    along = second.centre - first.centre
    along /= max(abs(along), 1e-9)
    ends = np.array((first.centre + 1.2 * first.radius * along, second.centre - 1.2 * second.radius * along))
    return np.column_stack((ends.real, ends.imag))


def _beyond(disc: Disc, seen: Sighting) -> Any:
    """Return a place (2,) in px beside a circle, away from the middle of the square."""
    away = disc.centre - sum(other.centre for other in seen.discs) / 4
    place = disc.centre + away / max(abs(away), 1e-9) * (disc.radius * 1.25 + 6)
    return np.array((place.real, place.imag))


def _line(canvas: Any, points: Any, colour: tuple[int, int, int]) -> None:
    """Draw a closed line that is visible on any background."""
    import cv2

    for part, width in ((_DARK, 3), (colour, 1)):
        cv2.polylines(canvas, [points.reshape(-1, 1, 2)], True, part, width, cv2.LINE_AA, SHIFT)


def _beside(panels: Sequence[Picture], columns: int) -> Picture:
    """Return the panels beside each other, with empty space filled below and to the right."""
    height = max(len(panel) for panel in panels)
    canvas = np.full((height, columns * WIDTH, 3), PLATE, dtype=np.uint8)
    for place, panel in enumerate(panels):
        canvas[: len(panel), place * WIDTH : (place + 1) * WIDTH] = panel
        canvas[:, (place + 1) * WIDTH - GAP : (place + 1) * WIDTH] = PLATE
    return canvas
