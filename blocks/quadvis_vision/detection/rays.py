"""Measure circles by their edges: rays from the middle of each, and the ellipse through where they leave it.

A line, a shadow or another thing beside a circle disturbs some rays only. Each ray is compared with its own
levels inside and outside the circle, so light that varies from place to place displaces no edge. Levels are
measured along the colour that separates the paint best from all that surrounds the circle, by Fisher's linear
discriminant: among grey joints on a white ceiling it is the hue of the paint. Rays that disagree with the
others count less, by the weights of Geman and McClure. All circles of a picture are measured together.
"""

from __future__ import annotations

import math
from functools import lru_cache
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
CALM = 0.6  # of the least variance: colours around that vary less need no discriminant
CLEAR = 0.5  # the least weight of rays that may all count alike
STRANGE = 0.3  # of the contrast: a ray with another or a brighter colour inside does not start on the paint
MIXED = 0.12  # of the contrast: if more than half of all rays are so strange, all are
SHORT = (0.6, 0.04)  # px and part of the radius: a ray with its edge so far inside is hidden
HIDDEN = 5  # hidden rays side by side that make a hidden part: less than a tenth of the diameter
SHARE_MIN = 0.3  # of all rays that must agree
WIDEST = 3.0  # px: the width of an edge, at most
SHARP = 0.9  # px: the width of an edge that is as sharp as the lens and the pixels allow
SOFT = (0.92, 1.4)  # of the contrast: if short rays see less of it, edges are at least so wide (px)
BLURRED = 0.1  # px: edges that are wider than was thought by more are looked at again
REACH = (2.6, 5.0)  # px: half the length of a ray for a sharp edge, and how it grows with the edge's width
FIRST = (0.6, 6.0)  # of the radius, and px: half the length of rays where the width is not known
STRAIN_MAX = 0.4  # of the radius: how far an edge may move in one look, so that no ellipse degenerates
POINT = 0.1  # px: the least radius
STEADY = 0.4  # px: an edge that moves less from look to look is final
LOOKS = 3

_PLACES = (2 * np.arange(SAMPLES) + 1) / SAMPLES - 1  # of samples, in halves of a ray's length
_ANGLES = 2 * math.pi * np.arange(RAYS) / RAYS
_UNITS = np.column_stack((np.cos(_ANGLES), np.sin(_ANGLES)))
_WAVES = np.column_stack((np.ones(RAYS), _UNITS, np.cos(2 * _ANGLES), np.sin(2 * _ANGLES)))
_PRODUCTS = (_WAVES[:, :, None] * _WAVES[:, None, :]).reshape(RAYS, 25)
_BLUR_WAVES = _WAVES[:, [0, 3, 4]]
_MIDDLE = RAYS // 2
_EVEN = np.linalg.pinv(_BLUR_WAVES).T
_IDENTITY = np.eye(3)


_LEVELS = np.zeros((SAMPLES, 2), np.float32)
_LEVELS[-LEVEL:, 0] = _LEVELS[:LEVEL, 1] = 1 / LEVEL
_ENDS = np.kron(_LEVELS, np.eye(3)).astype(np.float32)
# The mean of a ray and its first moment, so that a sharp edge at x gives x + 1 and x^2 - 1.
_MOMENTS = np.column_stack((np.full(SAMPLES, 2 / SAMPLES), 4 * _PLACES / SAMPLES)).astype(np.float32)
_TWICE = _MOMENTS[:, 0].copy()
_STRAINS = np.array([[1, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, -1], [0, 1, 1, 0]], float)
_ONES = np.eye(2)


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


def look(pixels: Pixels, centres: Array, shapes: Array, reach: Array, stiff: float = 0.0) -> Ellipses:
    """Return the ellipses next to given ones. Rays end `reach` (n,) px on either side of the given edges.

    `stiff` is the weight, relative to that of the rays, with which size and shape stay as they are.
    """
    count = len(centres)
    radii = radii_of(shapes)
    share = np.minimum(reach / radii, 0.95)
    ways = (shapes @ _UNITS.T).transpose(0, 2, 1).astype(np.float32)
    along = (1 + share[:, None] * _PLACES).astype(np.float32)
    places = ways[:, :, None] * along[:, None, :, None]
    places += centres.astype(np.float32)[:, None, None]
    seen = sampled(pixels, places.reshape(count * RAYS, SAMPLES, 2))
    ends = (seen.reshape(count * RAYS, 3 * SAMPLES) @ _ENDS).reshape(count, RAYS, 2, 3)
    middle = np.sort(ends, axis=1)[:, RAYS // 2]
    lights, paints = middle[:, 0], middle[:, 1]
    contrast = lights - paints
    power = product(contrast, contrast) + 1e-6
    axis = _axis(ends[:, :, 0] - lights[:, None], contrast, power)
    levels = product(lights, axis)[:, None] - (seen.reshape(count, -1, 3) @ axis[:, :, None])[..., 0]
    levels = levels.reshape(count, RAYS, SAMPLES)
    both = levels @ _LEVELS
    outer, span = both[..., 0], both[..., 1] - both[..., 0]
    good = span > SPAN_MIN
    span = np.where(good, span, 1.0)
    dark = (levels - outer[..., None]) / span[..., None]
    sums = dark @ _MOMENTS
    first = sums[..., 0] - 1
    variance = (sums[..., 1] + 1 - first * first) * (share * share)[:, None]
    # A soft step removes most of the noise, and all that is only a little darker than the ceiling.
    edge = stepped(dark, *STEP) @ _TWICE - 1
    least = (AGREE[0] / radii + AGREE[1])[:, None]
    waves, off, weights = _fit(share[:, None] * edge, good * np.minimum(span, 1.0) ** 2, least, stiff)
    waves = np.maximum(np.minimum(waves, STRAIN_MAX), -STRAIN_MAX)
    moved = centres + (shapes @ waves[:, 1:3, None])[..., 0]
    strain = (waves @ _STRAINS).reshape(count, 2, 2) + _ONES
    hidden = _hidden(ends[:, :, 1] - paints[:, None], ends[:, :, 0], paints, lights, power)
    hidden |= ~good
    hidden |= off < -(SHORT[0] / radii + SHORT[1])[:, None]
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
    return bool(max(moved.max(), grown.max()) < STEADY)


def sharpen(
    pixels: Pixels, centres: Array, shapes: Array, width: float, contrast: Array | None = None
) -> tuple[Ellipses, float, bool]:
    """Look with short rays until the ellipses, of known shapes, stay where they are.

    `width` (px) is that of the edges; the second value is what was measured. If it is not known, `contrast`
    (n,) is that of the circles: short rays see less of it where edges are wide. The third value is whether
    the first look found the ellipses where they were expected.
    """
    radii, first = radii_of(shapes), True
    for turn in range(LOOKS):
        found = look(pixels, centres, shapes, np.full(len(shapes), reach_for(width)), stiff=1.0)
        steady = _steady(found, centres, radii)
        centres, before, width = found.centres, max(width, SHARP), max(width, edge_width(found))
        if contrast is not None:
            seen = np.sort(contrasts(found) / contrast)
            width, contrast = max(width, SOFT[1] if seen[len(seen) // 2] < SOFT[0] else 0.0), None
        if turn == 0:
            first = steady
        if steady and width - before < BLURRED:
            break
    return found, width, first


def contrasts(found: Ellipses) -> Array:
    """Return the distances (n,) of the colours inside ellipses from those around them, in grey levels."""
    away = found.lights - found.paints
    return np.asarray(np.sqrt((away * away).sum(1)))


def radii_of(shapes: Array) -> Array:
    """Return the radii (n,) of circles with the areas of ellipses; one that has none counts as a point."""
    determinants = shapes[:, 0, 0] * shapes[:, 1, 1] - shapes[:, 0, 1] * shapes[:, 1, 0]
    return np.asarray(np.sqrt(np.maximum(np.abs(determinants), POINT * POINT)))


def symmetry(found: Ellipses) -> list[float]:
    """Return for each ellipse 1 if it is whole, less for each hidden ray, below 0.9 if a part is hidden."""
    result = []
    if not found.hidden.any() and found.weights.min() > CLEAR:
        return [1.0] * len(found.hidden)
    for hidden, share in zip(found.hidden, found.weights.mean(1).tolist(), strict=True):
        run = _longest_run(hidden)
        result.append(
            min(1.0 - 0.1 * run / (HIDDEN - 0.5), 0.9 * share / SHARE_MIN if share < SHARE_MIN else 1.0)
        )
    return result


def edge_width(found: Ellipses) -> float:
    """Return the width (px, a standard deviation) of the edges of all ellipses, where the blur is largest."""
    weights = found.weights
    if weights.min() == 1.0:
        radii = radii_of(found.shapes)
        mean, along, across = ((radii * radii) @ found.variance @ _EVEN / len(radii)).tolist()
        return min(math.sqrt(max(0.0, mean + math.hypot(along, across))), WIDEST)
    variance = (weights * found.variance * (radii_of(found.shapes) ** 2)[:, None]).sum(0)
    normal = _BLUR_WAVES.T @ (weights.sum(0)[:, None] * _BLUR_WAVES) + 1e-6 * _IDENTITY
    mean, along, across = np.linalg.solve(normal, variance @ _BLUR_WAVES).tolist()
    return min(math.sqrt(max(0.0, mean + math.hypot(along, across))), WIDEST)


def reach_for(width: float) -> float:
    """Return half the length (px) of rays that an edge of some width needs."""
    return REACH[0] + REACH[1] * max(0.0, width - SHARP)


def sampled(pixels: Pixels, places: Array) -> Array:
    """Return the colours (..., 3) between pixels at places (rows, columns, 2)."""
    import cv2

    nothing: Any = None
    seen = cv2.remap(pixels, places, nothing, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return seen.astype(np.float32)


def product(first: Array, second: Array) -> Array:
    """Return the scalar products (n,) of rows (n, 3)."""
    return np.asarray(np.einsum("ij,ij->i", first, second))


def stepped(dark: Array, low: float, high: float) -> Array:
    """Return 0 up to `low`, 1 from `high` on, and a straight slope between."""
    step = (dark - low) * (1 / (high - low))
    np.maximum(step, 0.0, out=step)
    return np.minimum(step, 1.0, out=step)


def floor(power: Array) -> Array:
    """Return the least variance (n,) of the colours around circles, from the squared contrast."""
    return SCATTER[0] ** 2 * power + SCATTER[1] ** 2


def _axis(around: Array, contrast: Array, power: Array) -> Array:
    """Return the axes (n, 3) of colour along which ceiling and paint are 1 apart, all else as near as can be.

    `around` (n, m, 3) are the differences of the colours around from the ceiling's.
    """
    least = floor(power)
    scatter = around.transpose(0, 2, 1) @ around / around.shape[1]
    if (np.einsum("nii->n", scatter) < CALM * least).all():
        return contrast / power[:, None]
    scatter += least[:, None, None] * _IDENTITY
    axis = np.linalg.solve(scatter, contrast[..., None])[..., 0]
    return np.asarray(axis / np.maximum(product(axis, contrast), 1e-9)[:, None])


@lru_cache(4)
def _solution(stiff: float) -> Array:
    """Return the map from edges (rays,) to their waves (5,) where all rays count alike."""
    prior = RAYS * np.diag([stiff, 0, 0, stiff, stiff])
    return np.asarray(np.linalg.solve(_WAVES.T @ _WAVES + prior, _WAVES.T).T.astype(np.float32))


def _fit(edges: Array, start: Array, least: Array, stiff: float) -> tuple[Array, Array, Array]:
    """Return the waves (n, 5) through edges (n, rays), what they leave of each edge, and the weights."""
    if start.min() > CLEAR:
        waves = edges @ _solution(stiff)
        off = edges - waves @ _WAVES.T
        if (np.abs(off) < 2 * least).all():
            return waves, off, np.ones_like(edges)
    weights = start
    prior = RAYS * np.diag([stiff, 0, 0, stiff, stiff]) + 1e-6 * np.eye(5)
    for turn in range(ROUNDS):
        normal = (weights @ _PRODUCTS).reshape(-1, 5, 5) + prior
        waves = np.linalg.solve(normal, ((weights * edges) @ _WAVES)[..., None])[..., 0]
        off = edges - waves @ _WAVES.T
        away = np.abs(off)
        scale = 2 * (weights * away).sum(1, keepdims=True) / (weights.sum(1, keepdims=True) + 1e-9)
        scale = np.maximum(scale, least) * 1.6 ** max(0, ROUNDS - 2 - turn)
        weights = start / (1 + (off / scale) ** 2) ** 2
    return waves, off, weights


def _hidden(away: Array, outer: Array, paints: Array, lights: Array, power: Array) -> Array:
    """Return which rays (n, rays) start on something else than the paint, which may be in a shadow.

    `away` (n, rays, 3) are the differences of the inner colours from the paint.
    """
    distance = np.einsum("nrc,nrc->nr", away, away) / power[:, None]
    if distance.max() < MIXED**2:
        return np.zeros(distance.shape, bool)
    bright = product(paints, paints) + 1e-6
    along = (away @ paints[:, :, None])[..., 0] / bright[:, None]
    light = (outer @ lights[:, :, None])[..., 0] / (product(lights, lights) + 1e-6)[:, None]
    far = distance - along * along * (bright / power)[:, None]
    more = np.maximum((1 + along) / np.maximum(light, 1.0) - 1.0, 0.0)
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
