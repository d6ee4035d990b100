"""Find the rough places of circles near expected ones: the centre of what is dark in a window."""

from __future__ import annotations

import math

import numpy as np

from quadvis_vision.detection.rays import Array, Pixels, floor, product, sampled, stepped

_GRID = 11  # samples along an edge of the coarse window
_WINDOW = 1.7  # half the edge of this window, in radii


def _window() -> Array:
    """Return the places (n, 2) of the samples of the coarse window, in radii."""
    edge = _WINDOW * ((2 * np.arange(_GRID) + 1) / _GRID - 1)
    u, v = np.meshgrid(edge, edge)
    return np.column_stack((u.ravel(), v.ravel()))


_SPOTS = _window()
_FAR = np.hypot(*_SPOTS.T)
_RIM = np.flatnonzero(_FAR > 1.5)
_CORE = np.where(_FAR < 0.45, 1 / np.count_nonzero(_FAR < 0.45), 0.0).astype(np.float32)
_SUMS = (np.column_stack((np.ones(len(_SPOTS)), _SPOTS)) * (_FAR < 1.6)[:, None]).astype(np.float32)
_CELL = (2 * _WINDOW / _GRID) ** 2 / math.pi


def approach(pixels: Pixels, centres: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Return rough centres (n, 2), radii (n,) and contrasts (n,) of discs near given places and radii."""
    places = np.multiply(_SPOTS, radii[:, None, None], dtype=np.float32)
    places += centres[:, None].astype(np.float32)
    seen = sampled(pixels, places)
    paints = _CORE @ seen
    rim = seen[:, _RIM]
    rim.sort(axis=1)
    lights = rim[:, len(_RIM) // 2]
    contrast = lights - paints
    power = product(contrast, contrast) + 1e-6
    # Grey things are darker by a factor: along this axis they differ from the ceiling as little as can be.
    slope = product(contrast, lights) / (product(lights, lights) + 4 * floor(power))
    axis = contrast - slope[:, None] * lights
    axis /= product(axis, contrast)[:, None] + 1e-6
    dark = product(lights, axis)[:, None] - (seen @ axis[:, :, None])[..., 0]
    sums = stepped(dark, 0.25, 0.75) @ _SUMS
    area = np.maximum(sums[:, :1], 1e-6)
    shift = np.maximum(np.minimum(sums[:, 1:] / area, 1.0), -1.0) * radii[:, None]
    growth = np.maximum(np.minimum(np.sqrt(area[:, 0] * _CELL), 1.3), 0.6)
    return centres + shift, radii * growth, np.sqrt(power)
