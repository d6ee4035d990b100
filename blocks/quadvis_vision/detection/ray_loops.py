"""The look along rays as machine code takes it: loops over single numbers, in the order of `rays`.

Both give the same bits; the mathematics is explained in `rays`.
"""

from __future__ import annotations

import math

import numpy as np

from quadvis_vision.detection.lanes import Array, Ellipses, Pixels, floor
from quadvis_vision.detection.loops import dot, halved, ranked, sample, solve, total
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
    POINT,
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

SLOPE = 1 / (STEP[1] - STEP[0])


def look_by_loops(pixels: Pixels, centres: Array, shapes: Array, reach: Array, stiff: float) -> Ellipses:
    """Return what `rays.look` returns."""
    count = len(centres)
    found = Ellipses(
        np.empty((count, 2)), np.empty((count, 2, 2)), np.empty((3, count)), np.empty((3, count)),
        np.empty((count, RAYS), np.bool_), np.empty(count), np.empty((9, count)), np.empty((6, count)),
    )  # fmt: skip
    seen, ends = np.empty((3, SAMPLES, RAYS)), np.empty((2, 3, RAYS))
    rows, work = np.empty((5, 6)), np.empty(RAYS)
    edges, variance, start, off, weights = np.empty((5, RAYS))
    for k in range(count):
        radius = math.sqrt(
            max(abs(shapes[k, 0, 0] * shapes[k, 1, 1] - shapes[k, 0, 1] * shapes[k, 1, 0]), POINT * POINT)
        )
        share = min(reach[k] / radius, REACH_MAX)
        sample_rays(pixels, centres[k], shapes[k], share, seen)
        for end, first in ((0, 0), (1, SAMPLES - 3)):
            for c in range(3):
                for r in range(RAYS):
                    level = (seen[c, first, r] + seen[c, first + 1, r] + seen[c, first + 2, r]) / 3
                    ends[end, c, r] = level
                    work[r] = level
                colours = found.lights if end else found.paints
                colours[c, k] = ranked(work, RAYS, RAYS // 2)
        paint = found.paints[0, k], found.paints[1, k], found.paints[2, k]
        light = found.lights[0, k], found.lights[1, k], found.lights[2, k]
        contrast = light[0] - paint[0], light[1] - paint[1], light[2] - paint[2]
        power = dot(contrast, contrast) + 1e-6
        axis = axis_of(ends[1], light, contrast, power, rows, work)
        find_edges(seen, dot(light, axis), axis, share, edges, variance, start)
        least = AGREE[0] / radius + AGREE[1]
        waves = fit(edges, start, least, stiff, rows, work, off, weights)
        find_hidden(ends, paint, light, power, found.hidden[k])
        short = -(SHORT[0] / radius + SHORT[1])
        for r in range(RAYS):
            if start[r] == 0 or off[r] < short:
                found.hidden[k, r] = True
        move(centres[k], shapes[k], waves, found.centres[k], found.shapes[k])
        found.weights[k] = total(weights, work) / RAYS
        for j in range(6):
            for r in range(RAYS):
                work[r] = BLUR[j, r] * weights[r]
            found.blur[j, k] = halved(work)
        for j in range(3):
            for r in range(RAYS):
                work[r] = BLUR_WAVES[j, r] * (weights[r] * (variance[r] * (radius * radius)))
            found.blur[6 + j, k] = halved(work)
            for r in range(RAYS):
                work[r] = CENTRE[j, r] * weights[r]
            found.scatter[j, k] = halved(work)
            for r in range(RAYS):
                work[r] = CENTRE[j, r] * (weights[r] * weights[r] * (off[r] * off[r]))
            found.scatter[3 + j, k] = halved(work)
    return found


def sample_rays(pixels: Pixels, centre: Array, shape: Array, share: float, seen: Array) -> None:
    """Fill `seen` (3, samples, rays) with the colours along the rays of one circle."""
    for r in range(RAYS):
        across = shape[0, 0] * COS[r] + shape[0, 1] * SIN[r]
        down = shape[1, 0] * COS[r] + shape[1, 1] * SIN[r]
        for s in range(SAMPLES):
            along = 1 + PLACES[s] * share
            blue, green, red = sample(pixels, centre[0] + along * across, centre[1] + along * down)
            seen[0, s, r], seen[1, s, r], seen[2, s, r] = blue, green, red


def axis_of(
    outer: Array,
    light: tuple[float, float, float],
    contrast: tuple[float, float, float],
    power: float,
    rows: Array,
    work: Array,
) -> tuple[float, float, float]:
    """Return the axis of colour of one circle."""
    least = floor(power)
    for r in range(RAYS):
        away = outer[0, r] - light[0], outer[1, r] - light[1], outer[2, r] - light[2]
        work[r] = dot(away, away)
    if halved(work) / RAYS < CALM * least:
        return contrast[0] / power, contrast[1] / power, contrast[2] / power
    for i in range(3):
        for j in range(3):
            for r in range(RAYS):
                work[r] = (outer[i, r] - light[i]) * (outer[j, r] - light[j])
            rows[i, j] = halved(work) / RAYS + (least if i == j else 0.0)
        rows[i, 3] = contrast[i]
    solve(rows, 3)
    axis = rows[0, 3], rows[1, 3], rows[2, 3]
    scale = max(dot(axis, contrast), 1e-9)
    return axis[0] / scale, axis[1] / scale, axis[2] / scale


def find_edges(
    seen: Array,
    zero: float,
    axis: tuple[float, float, float],
    share: float,
    edges: Array,
    variance: Array,
    start: Array,
) -> None:
    """Fill in the edges of one circle's rays and their variances, in radii, and the weights to start with."""
    dark, moment, step = np.empty((3, SAMPLES))
    for r in range(RAYS):
        for s in range(SAMPLES):
            dark[s] = zero - (seen[0, s, r] * axis[0] + seen[1, s, r] * axis[1] + seen[2, s, r] * axis[2])
        outside = (dark[9] + dark[10] + dark[11]) / 3
        span = (dark[0] + dark[1] + dark[2]) / 3 - outside
        start[r] = min(span, 1.0) * min(span, 1.0) if span > SPAN_MIN else 0.0
        span = span if span > SPAN_MIN else 1.0
        for s in range(SAMPLES):
            level = (dark[s] - outside) / span
            dark[s], moment[s] = level, level * MOMENTS[s]
            step[s] = min(max((level - STEP[0]) * SLOPE, 0.0), 1.0)
        first = along(dark) * (2 / SAMPLES) - 1
        variance[r] = (along(moment) + 1 - first * first) * (share * share)
        edges[r] = share * (along(step) * (2 / SAMPLES) - 1)


def along(x: Array) -> float:
    """Return the sum over the samples of a ray."""
    first, second = (x[0] + x[6]) + (x[3] + x[9]), (x[1] + x[7]) + (x[4] + x[10])
    return float(first + second + ((x[2] + x[8]) + (x[5] + x[11])))


def leave(edges: Array, waves: Array, off: Array) -> None:
    """Fill in what waves leave of the edges."""
    for r in range(RAYS):
        near = waves[0] * WAVES[0, r] + waves[1] * WAVES[1, r] + waves[2] * WAVES[2, r]
        off[r] = edges[r] - (near + waves[3] * WAVES[3, r] + waves[4] * WAVES[4, r])


def fit(
    edges: Array,
    start: Array,
    least: float,
    stiff: float,
    rows: Array,
    work: Array,
    off: Array,
    weights: Array,
) -> Array:
    """Return the waves (5,) through the edges of one circle; fill in what they leave, and the weights."""
    waves = np.empty(5)
    for j in range(5):
        for r in range(RAYS):
            work[r] = WAVES[j, r] * edges[r]
        waves[j] = halved(work) / (SQUARES[j] + RAYS * stiff * HELD[j])
    leave(edges, waves, off)
    alike = True
    for r in range(RAYS):
        alike = alike and start[r] > CLEAR and abs(off[r]) < 2 * least
    if alike:
        weights[:] = 1.0
        return waves
    weights[:] = start
    for wide in WIDENED:
        for i in range(5):
            for j in range(i, 5):
                for r in range(RAYS):
                    work[r] = PRODUCTS[i, j, r] * weights[r]
                rows[i, j] = rows[j, i] = halved(work)
            rows[i, i] += RAYS * stiff * HELD[i] + 1e-6
            for r in range(RAYS):
                work[r] = WAVES[i, r] * (weights[r] * edges[r])
            rows[i, 5] = halved(work)
        solve(rows, 5)
        for j in range(5):
            waves[j] = rows[j, 5]
        leave(edges, waves, off)
        for r in range(RAYS):
            work[r] = weights[r] * abs(off[r])
        scale = 2 * halved(work) / (total(weights, work) + 1e-9)
        for r in range(RAYS):
            part = off[r] / (max(scale, least) * wide)
            part = 1 + part * part
            weights[r] = start[r] / (part * part)
    return waves


def find_hidden(
    ends: Array,
    paint: tuple[float, float, float],
    light: tuple[float, float, float],
    power: float,
    hidden: Array,
) -> None:
    """Fill in which rays of one circle start on something else than the paint."""
    bright = dot(paint, paint) + 1e-6
    lamp = dot(light, light) + 1e-6
    strange = 0
    for r in range(RAYS):
        away = ends[0, 0, r] - paint[0], ends[0, 1, r] - paint[1], ends[0, 2, r] - paint[2]
        rim = ends[1, 0, r], ends[1, 1, r], ends[1, 2, r]
        distance = dot(away, away) / power
        part = dot(away, paint) / bright
        far = distance - part * part * (bright / power)
        more = max((1 + part) / max(dot(rim, light) / lamp, 1.0) - 1.0, 0.0)
        hidden[r] = far > STRANGE * STRANGE or more * more * (bright / power) > STRANGE * STRANGE
        strange += far > MIXED * MIXED
    if strange > RAYS / 2:
        hidden[:] = True


def move(centre: Array, shape: Array, waves: Array, moved: Array, strained: Array) -> None:
    """Fill in centre and shape of one circle after its edge moved by waves (5,), in radii."""
    for j in range(5):
        waves[j] = max(min(waves[j], STRAIN_MAX), -STRAIN_MAX)
    longer, wider, turned = 1 + waves[0] + waves[3], 1 + waves[0] - waves[3], waves[4]
    for k in range(2):
        across, down = shape[k, 0], shape[k, 1]
        moved[k] = centre[k] + (across * waves[1] + down * waves[2])
        strained[k, 0] = across * longer + down * turned
        strained[k, 1] = across * turned + down * wider
