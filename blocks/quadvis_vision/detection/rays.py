"""Measure circles by their edges: rays from the middle of each, and the ellipse through where they leave it.

A line, a shadow or another thing beside a circle disturbs some rays only. Each ray is compared with its own
levels inside and outside the circle, so light that varies from place to place displaces no edge. Levels are
measured along the colour that separates the paint best from all that surrounds the circle, by Fisher's linear
discriminant: among grey joints on a white ceiling it is the hue of the paint. Rays that disagree with the
others count less, by the weights of Geman and McClure. All circles of a picture are measured together.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Pixels = NDArray[np.uint8]

RAYS = 32
SAMPLES = 12  # along a ray
LEVEL = 3  # samples at either end of a ray that give its levels outside and inside
SPAN_MIN = 0.15  # of the contrast: a ray whose level changes less has no edge
AGREE = (0.06, 0.01)  # px and part of the radius: the least scale of the disagreement of rays
STEP = (0.2, 0.8)  # the soft step, as parts of the way from a ray's outer level to its inner one
ROUNDS = 4  # of weighting
SCATTER = (0.02, 8.0)  # part of the contrast, and grey levels: of colours around a circle, at least
STRANGE = 0.3  # of the contrast: a ray with another or a brighter colour inside does not start on the paint
MIXED = 0.12  # of the contrast: if more than half of all rays are so strange, all are
SHORT = (0.6, 0.04)  # px and part of the radius: a ray with its edge so far inside is hidden
HIDDEN = 5  # hidden rays side by side that make a hidden part: less than a tenth of the diameter
SHARE_MIN = 0.35  # of all rays that must agree
WIDEST = 3.0  # px: the width of an edge, at most
SHARP = 0.9  # px: the width of an edge that is as sharp as the lens and the pixels allow
SOFT = (0.92, 1.4)  # of the contrast: if short rays see less of it, edges are at least so wide (px)
BLURRED = 0.1  # px: edges that are wider than was thought by more are looked at again
REACH = (2.6, 5.0)  # px: half the length of a ray for a sharp edge, and how it grows with the edge's width
FIRST = (0.6, 6.0)  # of the radius, and px: half the length of rays where the width is not known
STEADY = (
    0.1,
    0.02,
    0.3,
)  # px and part of the radius, and px at most: an edge that moves less from look to look is final
LOOKS = 3
_GRID = 11  # samples along an edge of the coarse window
_WINDOW = 1.7  # half the edge of this window, in radii

_PLACES = (2 * np.arange(SAMPLES) + 1) / SAMPLES - 1  # of samples, in halves of a ray's length
_ANGLES = 2 * math.pi * np.arange(RAYS) / RAYS
_UNITS = np.column_stack((np.cos(_ANGLES), np.sin(_ANGLES)))
_WAVES = np.column_stack((np.ones(RAYS), _UNITS, np.cos(2 * _ANGLES), np.sin(2 * _ANGLES)))
_PRODUCTS = (_WAVES[:, :, None] * _WAVES[:, None, :]).reshape(RAYS, 25)
_BLUR_WAVES = _WAVES[:, [0, 3, 4]]
_MIDDLE = RAYS // 2
_IDENTITY = np.eye(3)


_LEVELS = np.zeros((SAMPLES, 2), np.float32)
_LEVELS[-LEVEL:, 0] = _LEVELS[:LEVEL, 1] = 1 / LEVEL
_ENDS = np.kron(_LEVELS, np.eye(3)).astype(np.float32)
_MOMENT = (4 * _PLACES / SAMPLES).astype(np.float32)


def _window() -> Array:
    """Return the places (n, 2) of the samples of the coarse window, in radii."""
    edge = _WINDOW * ((2 * np.arange(_GRID) + 1) / _GRID - 1)
    u, v = np.meshgrid(edge, edge)
    return np.column_stack((u.ravel(), v.ravel()))


_SPOTS = _window()
_FAR = np.hypot(*_SPOTS.T)
_CORE, _RIM = np.flatnonzero(_FAR < 0.45), np.flatnonzero(_FAR > 1.5)
_SUMS = np.column_stack((np.ones(len(_SPOTS)), _SPOTS)) * (_FAR < 1.6)[:, None]
_CELL = (2 * _WINDOW / _GRID) ** 2 / math.pi


class Ellipses(NamedTuple):
    """Measured ellipses: `centres` (n, 2) px, and `shapes` (n, 2, 2) px, maps from the unit circle.

    `lights` and `paints` (n, 3) are the colours around and inside them. `weights` (n, rays) from 0 to 1 say
    how far each ray agrees with the others; `hidden` (n, rays) whether it shows no edge of the paint;
    `variance` (n, rays) is that of the edge's width, in squared radii.
    """

    centres: Array
    shapes: Array
    lights: Array
    paints: Array
    weights: Array
    hidden: Array
    variance: Array


def approach(pixels: Pixels, centres: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Return rough centres (n, 2), radii (n,) and contrasts (n,) of discs near given places and radii."""
    places = (_SPOTS * radii[:, None, None] + centres[:, None]).astype(np.float32)
    seen = _sampled(pixels, places)
    paints, lights = seen[:, _CORE].mean(1), np.sort(seen[:, _RIM], axis=1)[:, len(_RIM) // 2]
    contrast = lights - paints
    # Grey things are darker by a factor: along the axis they differ from the ceiling as little as can be.
    power = (contrast * contrast).sum(1)
    axis = _axis(0.5 * lights[:, None], contrast, power)
    dark = ((lights[:, None] - seen) @ axis[:, :, None])[..., 0]
    sums = np.clip(2 * dark - 0.5, 0.0, 1.0) @ _SUMS
    area = np.maximum(sums[:, :1], 1e-6)
    shift = np.clip(sums[:, 1:] / area, -1.0, 1.0) * radii[:, None]
    sizes = radii * np.clip(np.sqrt(area[:, 0] * _CELL), 0.6, 1.3)
    return centres + shift, sizes, np.sqrt(power) + 1e-6


def look(pixels: Pixels, centres: Array, shapes: Array, reach: Array, stiff: float = 0.0) -> Ellipses:
    """Return the ellipses next to given ones. Rays end `reach` (n,) px on either side of the given edges.

    `stiff` is the weight, relative to that of the rays, with which size and shape stay as they are.
    """
    count = len(centres)
    radii = radii_of(shapes)
    share = np.minimum(reach / radii, 0.95)
    ways = (shapes @ _UNITS.T).transpose(0, 2, 1)
    along = 1 + share[:, None] * _PLACES
    places = ways[:, :, None] * along[:, None, :, None]
    places += centres[:, None, None]
    seen = _sampled(pixels, places.astype(np.float32).reshape(count * RAYS, SAMPLES, 2))
    ends = (seen.reshape(count * RAYS, 3 * SAMPLES) @ _ENDS).reshape(count, RAYS, 2, 3)
    ordered = np.sort(ends, axis=1)
    lights, paints = ordered[:, RAYS // 2, 0], ordered[:, RAYS // 2, 1]
    contrast = lights - paints
    power = (contrast * contrast).sum(1) + 1e-6
    axis = _axis(ends[:, :, 0] - lights[:, None], contrast, power)
    levels = (lights * axis).sum(1)[:, None] - (seen.reshape(count, -1, 3) @ axis[:, :, None])[..., 0]
    levels = levels.reshape(count, RAYS, SAMPLES)
    outer, inner = (levels @ _LEVELS).transpose(2, 0, 1)
    span = inner - outer
    good = span > SPAN_MIN
    span = np.where(good, span, 1.0)
    dark = (levels - outer[..., None]) / span[..., None]
    width = 2 * dark.mean(-1) - 1
    variance = (dark @ _MOMENT + 1 - width * width) * (share * share)[:, None]
    # A soft step removes most of the noise, and all that is only a little darker than the ceiling.
    edge = 2 * np.clip((dark - STEP[0]) / (STEP[1] - STEP[0]), 0.0, 1.0).mean(-1) - 1
    least = (AGREE[0] / radii + AGREE[1])[:, None]
    waves, off, weights = _fit(share[:, None] * edge, good * np.minimum(span, 1.0) ** 2, least, stiff)
    strain = np.empty((count, 2, 2))
    strain[:, 0, 0], strain[:, 1, 1] = 1 + waves[:, 0] + waves[:, 3], 1 + waves[:, 0] - waves[:, 3]
    strain[:, 0, 1] = strain[:, 1, 0] = waves[:, 4]
    moved = centres + (shapes @ waves[:, 1:3, None])[..., 0]
    hidden = (
        _hidden(ends[:, :, 1], ends[:, :, 0], paints, lights, power)
        | ~good
        | (off < -(SHORT[0] / radii + SHORT[1])[:, None])
    )
    return Ellipses(moved, shapes @ strain, lights, paints, weights, hidden, variance)


def settle(pixels: Pixels, centres: Array, shapes: Array) -> Ellipses:
    """Look until the ellipses stay where they are, whatever their shapes and the width of their edges."""
    for _ in range(LOOKS):
        radii = radii_of(shapes)
        found = look(pixels, centres, shapes, np.minimum(FIRST[0] * radii, FIRST[1]))
        steady = _steady(found, centres, radii)
        centres, shapes = found.centres, found.shapes
        if steady:
            break
    return found


def _steady(found: Ellipses, centres: Array, radii: Array) -> bool:
    """Return whether ellipses are where a look expected them, with the sizes it expected."""
    moved = np.abs(found.centres - centres).max(1)
    grown = np.abs(radii_of(found.shapes) - radii)
    return bool((np.maximum(moved, grown) < np.minimum(STEADY[0] + STEADY[1] * radii, STEADY[2])).all())


def sharpen(
    pixels: Pixels, centres: Array, shapes: Array, width: float, contrast: Array | None = None
) -> tuple[Ellipses, float]:
    """Look with short rays until the ellipses, of known shapes, stay where they are.

    `width` (px) is that of the edges; the second value is what was measured. If it is not known, `contrast`
    (n,) is that of the circles: short rays see less of it where edges are wide.
    """
    radii = radii_of(shapes)
    for _ in range(LOOKS):
        found = look(pixels, centres, shapes, np.full(len(shapes), reach_for(width)), stiff=1.0)
        steady = _steady(found, centres, radii)
        centres, before, width = found.centres, max(width, SHARP), max(width, edge_width(found))
        if contrast is not None:
            seen = np.sort(contrasts(found) / contrast)
            width, contrast = max(width, SOFT[1] if seen[len(seen) // 2] < SOFT[0] else 0.0), None
        if steady and width - before < BLURRED:
            break
    return found, width


def contrasts(found: Ellipses) -> Array:
    """Return the distances (n,) of the colours inside ellipses from those around them, in grey levels."""
    away = found.lights - found.paints
    return np.asarray(np.sqrt((away * away).sum(1)))


def radii_of(shapes: Array) -> Array:
    """Return the radii (n,) of circles with the areas of ellipses."""
    determinants = shapes[:, 0, 0] * shapes[:, 1, 1] - shapes[:, 0, 1] * shapes[:, 1, 0]
    return np.asarray(np.sqrt(np.abs(determinants)))


def symmetry(found: Ellipses) -> list[float]:
    """Return for each ellipse 1 if it is whole, less for each hidden ray, below 0.9 if a part is hidden."""
    result = []
    for hidden, share in zip(found.hidden, found.weights.mean(1).tolist(), strict=True):
        run = _longest_run(hidden) if hidden.any() else 0
        result.append(
            min(1.0 - 0.1 * run / (HIDDEN - 0.5), 0.9 * share / SHARE_MIN if share < SHARE_MIN else 1.0)
        )
    return result


def edge_width(found: Ellipses) -> float:
    """Return the width (px, a standard deviation) of the edges of all ellipses, where the blur is largest."""
    variance = found.variance * (radii_of(found.shapes) ** 2)[:, None]
    normal = np.einsum("nr,ri,rj->ij", found.weights, _BLUR_WAVES, _BLUR_WAVES) + 1e-6 * np.eye(3)
    mean, along, across = np.linalg.solve(normal, ((found.weights * variance) @ _BLUR_WAVES).sum(0)).tolist()
    return min(math.sqrt(max(0.0, mean + math.hypot(along, across))), WIDEST)


def reach_for(width: float) -> float:
    """Return half the length (px) of rays that an edge of some width needs."""
    return REACH[0] + REACH[1] * max(0.0, width - SHARP)


def _sampled(pixels: Pixels, places: Array) -> Array:
    """Return the colours (..., 3) between pixels at places (rows, columns, 2)."""
    import cv2

    nothing: Any = None
    seen = cv2.remap(pixels, places, nothing, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.float32)


def _axis(around: Array, contrast: Array, power: Array) -> Array:
    """Return the axes (n, 3) of colour along which ceiling and paint are 1 apart, all else as near as can be.

    `around` (n, m, 3) are the differences of the colours around from the ceiling's.
    """
    scatter = around.transpose(0, 2, 1) @ around / around.shape[1]
    scatter += (SCATTER[0] ** 2 * power + SCATTER[1] ** 2)[:, None, None] * _IDENTITY
    axis = np.linalg.solve(scatter, contrast[..., None])[..., 0]
    return np.asarray(axis / np.maximum((axis * contrast).sum(1), 1e-9)[:, None])


def _fit(edges: Array, start: Array, least: Array, stiff: float) -> tuple[Array, Array, Array]:
    """Return the waves (n, 5) through edges (n, rays), what they leave of each edge, and the weights."""
    weights = start
    prior = RAYS * np.diag([stiff, 0, 0, stiff, stiff]) + 1e-6 * np.eye(5)
    for turn in range(ROUNDS):
        normal = (weights @ _PRODUCTS).reshape(-1, 5, 5) + prior
        waves = np.linalg.solve(normal, ((weights * edges) @ _WAVES)[..., None])[..., 0]
        off = edges - waves @ _WAVES.T
        away = np.abs(off)
        if (away < 2 * least).all() and (start > 0.5).all():
            break  # all rays agree
        scale = 2 * (weights * away).sum(1, keepdims=True) / (weights.sum(1, keepdims=True) + 1e-9)
        scale = np.maximum(scale, least) * 1.6 ** max(0, ROUNDS - 2 - turn)
        weights = start / (1 + (off / scale) ** 2) ** 2
    return waves, off, weights


def _hidden(inner: Array, outer: Array, paints: Array, lights: Array, power: Array) -> Array:
    """Return which rays (n, rays) start on something else than the paint, which may be in a shadow."""
    bright = (paints * paints).sum(1) + 1e-6
    along = (inner @ paints[:, :, None])[..., 0] / bright[:, None]
    light = (outer @ lights[:, :, None])[..., 0] / ((lights * lights).sum(1) + 1e-6)[:, None]
    aside = inner - along[..., None] * paints[:, None]
    more = np.maximum(along / np.maximum(light, 1.0) - 1.0, 0.0)
    far = (aside * aside).sum(-1) / power[:, None]
    # If the paint is half hidden, the median colour is none of the two.
    mixed = (far > MIXED**2).mean(1) > 0.5
    brighter = more * more * (bright / power)[:, None] > STRANGE**2
    return np.asarray((far > STRANGE**2) | brighter | mixed[:, None])


def _longest_run(flags: Array) -> int:
    """Return the number of flags side by side that are true, at most, around a circle."""
    run, mask, count = 0, int("".join("1" if flag else "0" for flag in flags.tolist()), 2), len(flags)
    full = (1 << count) - 1
    while mask and run < count:
        mask &= ((mask << 1) | (mask >> (count - 1))) & full
        run += 1
    return run
