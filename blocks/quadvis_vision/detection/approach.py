"""Find the rough places of circles near expected ones: the centre of what is dark in a window."""

from __future__ import annotations

import math

import numpy as np

from quadvis.native.functions import compiled_as
from quadvis_vision.detection.lanes import Array, Pixels, floor, middle, product, sampled, stepped, summed
from quadvis_vision.detection.loops import halved, ranked, sample, total

_GRID = 11  # samples along an edge of the coarse window
_WINDOW = 1.7  # half the edge of this window, in radii
LOW, HIGH = 0.25, 0.75  # of the contrast: the soft step
SLOPE = 1 / (HIGH - LOW)
_SPOTS = 128  # samples, with some that count nothing


def _window() -> tuple[Array, Array]:
    """Return the places of the samples of the coarse window, in radii; those that only fill up are far."""
    edge = _WINDOW * ((2 * np.arange(_GRID) + 1) / _GRID - 1)
    right, down = np.full((2, _SPOTS), _WINDOW)
    grid = np.meshgrid(edge, edge)
    right[: _GRID * _GRID], down[: _GRID * _GRID] = grid[0].ravel(), grid[1].ravel()
    return right, down


_RIGHT, _DOWN = _window()
_FAR = np.sqrt(_RIGHT * _RIGHT + _DOWN * _DOWN)
_RIM = np.flatnonzero((_FAR > 1.5) & (np.arange(_SPOTS) < _GRID * _GRID))
_CORE = np.where(_FAR < 0.45, 1 / np.count_nonzero(_FAR < 0.45), 0.0)
_NEAR = np.where(_FAR < 1.6, 1.0, 0.0)
_CELL = (2 * _WINDOW / _GRID) ** 2 / math.pi


def approach_by_loops(pixels: Pixels, centres: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Return what `approach` returns, to the bit: it is taken in machine code."""
    count = len(radii)
    rough, sizes, contrasts = np.empty((count, 2)), np.empty(count), np.empty(count)
    seen, work, rim = np.empty((3, _SPOTS)), np.empty(_SPOTS), np.empty(len(_RIM))
    for k in range(count):
        for s in range(_SPOTS):
            u, v = centres[k, 0] + radii[k] * _RIGHT[s], centres[k, 1] + radii[k] * _DOWN[s]
            seen[0, s], seen[1, s], seen[2, s] = sample(pixels, u, v)
        paint, light = np.empty((2, 3))
        for c in range(3):
            for s in range(_SPOTS):
                work[s] = seen[c, s] * _CORE[s]
            paint[c] = halved(work)
            for s in range(len(_RIM)):
                rim[s] = seen[c, _RIM[s]]
            light[c] = ranked(rim, len(_RIM), len(_RIM) // 2)
        contrast = light - paint
        power = product(contrast, contrast) + 1e-6
        slope = product(contrast, light) / (product(light, light) + 4 * floor(power))
        axis = contrast - slope * light
        axis = axis / (product(axis, contrast) + 1e-6)
        zero = product(light, axis)
        step = np.empty(_SPOTS)
        for s in range(_SPOTS):
            dark = zero - (seen[0, s] * axis[0] + seen[1, s] * axis[1] + seen[2, s] * axis[2])
            step[s] = min(max((dark - LOW) * SLOPE, 0.0), 1.0) * _NEAR[s]
        area = max(total(step, work), 1e-6)
        for s in range(_SPOTS):
            work[s] = step[s] * _RIGHT[s]
        rough[k, 0] = centres[k, 0] + max(min(halved(work) / area, 1.0), -1.0) * radii[k]
        for s in range(_SPOTS):
            work[s] = step[s] * _DOWN[s]
        rough[k, 1] = centres[k, 1] + max(min(halved(work) / area, 1.0), -1.0) * radii[k]
        sizes[k] = radii[k] * max(min(math.sqrt(area * _CELL), 1.3), 0.6)
        contrasts[k] = math.sqrt(power)
    return rough, sizes, contrasts


@compiled_as(approach_by_loops)
def approach(pixels: Pixels, centres: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Return rough centres (n, 2), radii (n,) and contrasts (n,) of discs near given places and radii."""
    count = len(radii)
    size = radii[None, :, None]
    places = centres[None]
    seen = sampled(pixels, places[:, :, :1] + size * _RIGHT, places[:, :, 1:] + size * _DOWN)
    colours = seen.reshape(3, count, _SPOTS)
    paints = summed(colours * _CORE)
    lights = middle(colours[:, :, _RIM])
    contrast = lights - paints
    power = product(contrast, contrast) + 1e-6
    # Grey things are darker by a factor: along this axis they differ from the ceiling as little as can be.
    slope = product(contrast, lights) / (product(lights, lights) + 4 * floor(power))
    axis = contrast - slope * lights
    axis = axis / (product(axis, contrast) + 1e-6)
    dark = product(lights, axis)[:, None] - product(colours, axis[:, :, None])
    step = stepped(dark, LOW, HIGH) * _NEAR
    area = np.maximum(summed(step), 1e-6)
    right, down = summed(step * _RIGHT) / area, summed(step * _DOWN) / area
    shift = np.maximum(np.minimum(np.column_stack((right, down)), 1.0), -1.0)
    growth = np.maximum(np.minimum(np.sqrt(area * _CELL), 1.3), 0.6)
    return centres + shift * radii[:, None], radii * growth, np.sqrt(power)
