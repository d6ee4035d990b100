"""Measure circles by their edges: rays from the middle of each, and the ellipse through where they leave it.

A line, a shadow or another thing beside a circle disturbs some rays only. Each ray is compared with its own
levels inside and outside the circle, so light that varies from place to place displaces no edge. Levels are
measured along the colour that separates the paint best from all that surrounds the circle, by Fisher's linear
discriminant: among grey joints on a white ceiling it is the hue of the paint. Rays that disagree with the
others count less, by the weights of Geman and McClure. All circles of a picture are measured together.
"""

from __future__ import annotations

import numpy as np

from quadvis.native.functions import compiled_as
from quadvis_vision.detection.lanes import (
    Array,
    Ellipses,
    Pixels,
    floor,
    middle,
    product,
    radii_of,
    sampled,
    solved,
    stepped,
    summed,
)
from quadvis_vision.detection.ray_loops import look_by_loops
from quadvis_vision.detection.ray_numbers import (
    AGREE,
    BLUR,
    BLUR_WAVES,
    CALM,
    CENTRE,
    CLEAR,
    COS,
    HELD,
    MIXED,
    MOMENTS,
    PLACES,
    PRODUCTS,
    RAYS,
    REACH_MAX,
    SAMPLES,
    SHORT,
    SIN,
    SPAN_MIN,
    SQUARES,
    STEP,
    STRAIN_MAX,
    STRANGE,
    WAVES,
    WIDENED,
)

_BLUR, _BLUR_WAVES, _CENTRE = BLUR[:, None], BLUR_WAVES[:, None], CENTRE[:, None]
_TONES = np.eye(3)[:, :, None]


@compiled_as(look_by_loops)
def look(pixels: Pixels, centres: Array, shapes: Array, reach: Array, stiff: float) -> Ellipses:
    """Return the ellipses next to given ones. Rays end `reach` (n,) px on either side of the given edges.

    `stiff` is the weight, relative to that of the rays, with which size and shape stay as they are.
    """
    radii = radii_of(shapes)
    share = np.minimum(reach / radii, REACH_MAX)[:, None]
    maps = shapes.reshape(-1, 4, 1)
    along = 1 + PLACES[:, None, None] * share
    u = centres[:, :1] + along * (maps[:, 0] * COS + maps[:, 1] * SIN)
    v = centres[:, 1:] + along * (maps[:, 2] * COS + maps[:, 3] * SIN)
    seen = sampled(pixels, u, v)
    inner = (seen[:, 0] + seen[:, 1] + seen[:, 2]) / 3
    outer = (seen[:, 9] + seen[:, 10] + seen[:, 11]) / 3
    paints, lights = middle(inner), middle(outer)
    contrast = lights - paints
    power = product(contrast, contrast) + 1e-6
    axis = _axis(outer, lights, contrast, power)
    levels = product(lights, axis)[:, None] - product(seen, axis[:, None, :, None])
    outside = (levels[9] + levels[10] + levels[11]) / 3
    span = (levels[0] + levels[1] + levels[2]) / 3 - outside
    good = span > SPAN_MIN
    span = np.where(good, span, 1.0)
    dark = (levels - outside) / span
    # The mean of a ray and its first moment, so that a sharp edge at x gives x + 1 and x^2 - 1.
    first = _mean(dark) - 1
    variance = (_total(dark * MOMENTS[:, None, None]) + 1 - first * first) * (share * share)
    # A soft step removes most of the noise, and all that is only a little darker than the ceiling.
    edges = share * (_mean(stepped(dark, STEP[0], STEP[1])) - 1)
    least = (AGREE[0] / radii + AGREE[1])[:, None]
    start = np.where(good, np.minimum(span, 1.0) * np.minimum(span, 1.0), 0.0)
    waves, off, weights = _fit(edges, start, least, stiff)
    hidden = _hidden(inner, outer, paints, lights, power)
    hidden = hidden | ~good | (off < -(SHORT[0] / radii + SHORT[1])[:, None])
    moved, strained = _moved(centres, shapes, np.maximum(np.minimum(waves, STRAIN_MAX), -STRAIN_MAX))
    width = variance * (radii * radii)[:, None]
    blur = summed(np.concatenate((_BLUR * weights, _BLUR_WAVES * (weights * width))))
    scatter = summed(np.concatenate((_CENTRE * weights, _CENTRE * (weights * weights * (off * off)))))
    return Ellipses(moved, strained, lights, paints, hidden, summed(weights) / RAYS, blur, scatter)


def _moved(centres: Array, shapes: Array, waves: Array) -> tuple[Array, Array]:
    """Return centres and shapes after the edges moved by `waves` (5, n), in radii."""
    moved, strained = np.empty_like(centres), np.empty_like(shapes)
    longer, wider, turned = 1 + waves[0] + waves[3], 1 + waves[0] - waves[3], waves[4]
    for k in range(2):
        across, down = shapes[:, k, 0], shapes[:, k, 1]
        moved[:, k] = centres[:, k] + (across * waves[1] + down * waves[2])
        strained[:, k, 0] = across * longer + down * turned
        strained[:, k, 1] = across * turned + down * wider
    return moved, strained


def _total(values: Array) -> Array:
    """Return the sums over the twelve samples, the first axis."""
    half = values[:6] + values[6:]
    third = half[:3] + half[3:]
    return np.asarray(third[0] + third[1] + third[2])


def _mean(values: Array) -> Array:
    """Return twice the mean over the samples."""
    return _total(values) * (2 / SAMPLES)


def _axis(outer: Array, lights: Array, contrast: Array, power: Array) -> Array:
    """Return the axes (3, n) of colour along which ceiling and paint are 1 apart, all else as near as can be.

    `outer` (3, n, rays) are the colours around.
    """
    least = floor(power)
    away = outer - lights[:, :, None]
    plain = contrast / power
    calm = summed(product(away, away)) / RAYS < CALM * least
    if calm.all():
        return plain
    equations = np.empty((3, 4, len(power)))
    equations[:, :3] = summed(away[:, None] * away[None]) / RAYS + least * _TONES
    equations[:, 3] = contrast
    axis = solved(equations)
    return np.where(calm, plain, axis / np.maximum(product(axis, contrast), 1e-9))


def waved(waves: Array) -> Array:
    """Return the sums (n, rays) of waves (5, n) along the rays."""
    parts = waves[:, :, None] * WAVES[:, None]
    return np.asarray(parts[0] + parts[1] + parts[2] + parts[3] + parts[4])


def _fit(edges: Array, start: Array, least: Array, stiff: float) -> tuple[Array, Array, Array]:
    """Return the waves (5, n) through edges (n, rays), what they leave of each edge, and the weights."""
    waves = summed(WAVES[:, None] * edges) / (SQUARES + RAYS * stiff * HELD)[:, None]
    off = edges - waved(waves)
    alike = ((start > CLEAR) & (np.abs(off) < 2 * least)).all(1)
    if alike.all():
        return waves, off, np.ones_like(edges)
    even, left = waves, off
    weights = start
    equations = np.empty((5, 6, len(edges)))
    held = ((RAYS * stiff * HELD + 1e-6)[:, None] * np.eye(5))[:, :, None]
    for wide in WIDENED:
        equations[:, :5] = summed(PRODUCTS[:, :, None] * weights) + held
        equations[:, 5] = summed(WAVES[:, None] * (weights * edges))
        waves = solved(equations)
        off = edges - waved(waves)
        scale = 2 * summed(weights * np.abs(off)) / (summed(weights) + 1e-9)
        part = off / (np.maximum(scale[:, None], least) * wide)
        part = 1 + part * part
        weights = start / (part * part)
    same = alike[:, None]
    return np.where(alike, even, waves), np.where(same, left, off), np.where(same, 1.0, weights)


def _hidden(inner: Array, outer: Array, paints: Array, lights: Array, power: Array) -> Array:
    """Return which rays (n, rays) start on something else than the paint, which may be in a shadow.

    `inner` and `outer` (3, n, rays) are the colours at both ends of the rays.
    """
    paint, light = paints[:, :, None], lights[:, :, None]
    away, power = inner - paint, power[:, None]
    distance = product(away, away) / power
    if distance.max() < MIXED * MIXED:  # then none is strange
        return np.zeros(distance.shape, bool)
    bright = product(paint, paint) + 1e-6
    along = product(away, paint) / bright
    lit = product(outer, light) / (product(light, light) + 1e-6)
    far = distance - along * along * (bright / power)
    more = np.maximum((1 + along) / np.maximum(lit, 1.0) - 1.0, 0.0)
    # If the paint is half hidden, the median colour is none of the two.
    mixed = (far > MIXED * MIXED).sum(1, keepdims=True) > RAYS / 2
    brighter = more * more * (bright / power) > STRANGE * STRANGE
    return np.asarray((far > STRANGE * STRANGE) | brighter | mixed)
