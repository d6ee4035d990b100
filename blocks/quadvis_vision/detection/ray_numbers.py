"""The numbers by which rays are looked along, and the waves that are fitted to the edges that they meet."""

from __future__ import annotations

import math

import numpy as np

RAYS = 32
SAMPLES = 12  # along a ray; the first and the last three give its levels inside and outside
SPAN_MIN = 0.15  # of the contrast: a ray whose level changes less has no edge
AGREE = (0.06, 0.01)  # px and part of the radius: the least scale of the disagreement of rays
STEP = (0.2, 0.8)  # the soft step, as parts of the way from a ray's outer level to its inner one
WIDENED = (2.56, 1.6, 1.0, 1.0)  # the scale of disagreement, round after round of weighting
SCATTER = (0.02, 8.0)  # part of the contrast, and grey levels: of colours around a circle, at least
CALM = 0.6  # of the least variance: colours around that vary less need no discriminant
CLEAR = 0.5  # the least weight of rays that may all count alike
STRANGE = 0.3  # of the contrast: a ray with another or a brighter colour inside does not start on the paint
MIXED = 0.12  # of the contrast: if more than half of all rays are so strange, all are
SHORT = (0.6, 0.04)  # px and part of the radius: a ray with its edge so far inside is hidden
REACH_MAX = 0.95  # of the radius: half the length of a ray
STRAIN_MAX = 0.4  # of the radius: how far an edge may move in one look, so that no ellipse degenerates
POINT = 0.1  # px: the least radius

PLACES = (2 * np.arange(SAMPLES) + 1) / SAMPLES - 1  # of the samples, in halves of a ray's length
MOMENTS = 4 * PLACES / SAMPLES
_ANGLES = 2 * math.pi * np.arange(RAYS) / RAYS
COS, SIN = np.cos(_ANGLES), np.sin(_ANGLES)
WAVES = np.array((np.ones(RAYS), COS, SIN, np.cos(2 * _ANGLES), np.sin(2 * _ANGLES)))
PRODUCTS = WAVES[:, None] * WAVES[None]
# The waves are orthogonal on the rays; these are their squares. Stiffness holds size and shape.
SQUARES = np.array((32.0, 16.0, 16.0, 16.0, 16.0))
HELD = np.array((1.0, 0.0, 0.0, 1.0, 1.0))
# The width of a blurred edge has the waves 0, 3 and 4, the centre 1 and 2. Products by triangles.
BLUR_WAVES = WAVES[[0, 3, 4]]
BLUR = PRODUCTS[[0, 0, 3, 0, 3, 4], [0, 3, 3, 4, 4, 4]]
CENTRE = PRODUCTS[[1, 1, 2], [1, 2, 2]]
