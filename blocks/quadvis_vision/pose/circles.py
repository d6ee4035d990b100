"""What is seen of the target's circles, and where a pose would show them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from quadvis_vision.camera.pinhole import Pinhole, Slopes, normalised, pixel, pixel_slopes
from quadvis_vision.camera.projection import CORNERS, camera_point, ellipse_centre
from quadvis_vision.pose.pose import Pose


class Circle(NamedTuple):
    """A circle as it is seen.

    `u`, `v` are the centre of its ellipse in px; `x`, `y` the same as a normalised point; `forward`, `right`
    its place on the target (m); `weights` the derivatives of u and v by x and y, divided by the standard
    deviation of u and v.
    """

    u: float
    v: float
    x: float
    y: float
    forward: float
    right: float
    weights: Slopes


def seen_circles(centres: Any, camera: Pinhole, side: float, sigma: Any) -> list[Circle]:
    """Return the circles of which centres (4, 2) in px are known and belong to a ray, in their order.

    `sigma` (4,) in px are the standard deviations of their coordinates.
    """
    found = []
    for index in range(4):
        u, v = float(centres[index, 0]), float(centres[index, 1])
        x, y = normalised(camera, u, v)
        if math.isfinite(x) and math.isfinite(y):
            a, b, c, d = pixel_slopes(camera, x, y)
            s = float(sigma[index])
            weights = (a / s, b / s, c / s, d / s)
            forward, right = CORNERS[index]
            found.append(Circle(u, v, x, y, side * forward, side * right, weights))
    return found


def image(pose: Pose, circle: Circle, radius: float) -> tuple[float, float]:
    """Return the normalised centre of the ellipse that a circle of a radius (m) becomes for a pose."""
    point = camera_point(pose.rotation, pose.position, circle.forward, circle.right)
    (_, _, right), (_, _, down), (_, _, ahead) = pose.rotation
    return ellipse_centre(point, (right, down, ahead), radius)


def misfit(pose: Pose, circles: list[Circle], radius: float) -> float:
    """Return the rms distance of normalised points from where a pose shows them."""
    total = 0.0
    for circle in circles:
        x, y = image(pose, circle, radius)
        total += (x - circle.x) * (x - circle.x) + (y - circle.y) * (y - circle.y)
    return math.sqrt(total / len(circles))


def residual(pose: Pose, circles: list[Circle], radius: float, camera: Pinhole) -> float:
    """Return the rms distance in px of the circles from where a pose shows them."""
    total = 0.0
    for circle in circles:
        x, y = image(pose, circle, radius)
        u, v = pixel(camera, x, y)
        total += (u - circle.u) * (u - circle.u) + (v - circle.v) * (v - circle.v)
    return math.sqrt(total / len(circles))
