"""The camera's pose when its tilt is known: position and yaw in closed form from two circles or more.

Rays that are turned back by roll and pitch are the rays of a camera that looks straight up, and such a camera
maps the target by a similarity. In level axes, forward and right at unit distance, circle i with the centre
P_i appears at

    m_i = [a -b; b a] P_i + c,    a + i b = exp(-i yaw) / z,

which is linear in a, b and the two numbers of c. So two circles are enough, and the solution is unique.
Frames and signs are those of `quadvis_vision.pose.pose`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.camera.projection import CAMERA_FROM_BODY, rotation
from quadvis_vision.pose.pose import camera_points
from quadvis_vision.pose.refine import View, pose_of, slopes

Array = NDArray[np.float64]
Level = tuple[float, float, float, float]  # x, y, z (m) of the camera in the target frame, yaw (rad)
Sines = tuple[float, float, float, float]  # sine and cosine of roll, sine and cosine of pitch
Seen = tuple[float, float, float, float, float]  # of a circle: forward, right, the ray's height; its corner

# Corners 1..4 of the square of side 1 in target axes: forward and right of its middle.
_CORNERS = ((-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5))


def level_pose(points: Array, roll: float, pitch: float, side: float, radius: float = 0.0) -> Level | None:
    """Return the pose from normalised points (4, 2) and a finite tilt (rad); None if the points give none.

    Rows with NaN are missing circles. The points are the centres of the ellipses that the circles become;
    with a `radius` (m) above zero they are corrected to the images of the circles' centres.
    """
    tilt = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    seen = _levelled(points, tilt)
    if seen is None:
        return None
    pose = _fit(seen, side)
    for _ in range(2 if radius else 0):  # the correction needs the distance, and changes it a little
        if pose is None:
            return None
        pose = _fit(_corrected(seen, tilt, (radius / pose[2]) ** 2), side)
    return pose


@np.errstate(all="ignore")
def level_covariance(view: View, unknowns: Array, sigma: float) -> Array | None:
    """Return the covariance (4, 4) of x, y, z, yaw from `level_pose`; None if the view is not enough.

    `view` holds the points that are not missing and their weights, `unknowns` (6,) are the pose's x, y, z,
    yaw, roll and pitch, and `sigma` (rad) is the standard deviation of roll and of pitch.
    """
    pose = pose_of(unknowns)
    points = camera_points(pose, view.corners)
    if not (points[:, 2] > 0).all():
        return None
    level = rotation((unknowns[4], unknowns[5], 0.0)) @ CAMERA_FROM_BODY.T
    away = points @ level.T
    down = away[:, 2:, None] / points[:, 2:, None]
    turned = (level[:2, :2] - away[:, :2, None] / away[:, 2:, None] * level[2, :2]) / -down  # m by points
    fitted = (turned @ slopes(pose, points, float(unknowns[4]))).reshape(-1, 6)
    try:
        gains = np.linalg.solve(fitted[:, :4].T @ fitted[:, :4], fitted[:, :4].T)
        by_picture = gains.reshape(4, -1, 1, 2) @ turned @ np.linalg.inv(view.weights)
    except np.linalg.LinAlgError:
        return None
    by_picture, by_tilt = by_picture.reshape(4, -1), sigma * gains @ fitted[:, 4:]
    return np.asarray(by_picture @ by_picture.T + by_tilt @ by_tilt.T)


# Plain numbers, as here, are on four points several times faster than arrays or complex numbers.


def _levelled(points: Array, tilt: Sines) -> list[Seen] | None:
    """Return what is seen of each circle that is not missing; None if one is below the camera."""
    sr, cr, sp, cp = tilt
    found: list[Seen] = []
    for (x, y), corner in zip(points.tolist(), _CORNERS):  # noqa: B905  # strict takes a tenth of the time
        w = sr * y + cr
        up = sp * x + cp * w
        if up > 0:
            found.append(((cp * x - sp * w) / up, (sr - cr * y) / up, up, *corner))
        elif up <= 0:
            return None
    return found


def _corrected(seen: list[Seen], tilt: Sines, size: float) -> list[Seen]:
    """Return the images of the circles' centres; `size` is their squared radius in a level camera's picture.

    The centre of an ellipse is the pole of the picture's horizon. In level directions the horizon is the line
    sp cr forward - sr right = cp cr, and 1 / up is the centre's distance from it.
    """
    sr, cr, sp, _ = tilt
    rise = 4 * size * (sp * sp * cr * cr + sr * sr)
    found: list[Seen] = []
    for forward, right, up, p, q in seen:
        shift = 2 * size / (1 / up + math.sqrt(1 / (up * up) + rise))
        found.append((forward - shift * sp * cr, right + shift * sr, up, p, q))
    return found


def _fit(seen: list[Seen], side: float) -> Level | None:
    """Return the least squares pose."""
    count = len(seen)
    if count < 2:
        return None
    mx = my = px = py = real = imaginary = 0.0
    for forward, right, _, p, q in seen:
        mx += forward
        my += right
        px += p
        py += q
        real += p * forward + q * right
        imaginary += p * right - q * forward
    spread = 0.5 * count - (px * px + py * py) / count
    a = (real - (px * mx + py * my) / count) / spread
    b = (imaginary - (px * my - py * mx) / count) / spread
    scale = a * a + b * b
    if not 0 < scale < math.inf:
        return None
    x, y = px - (a * mx + b * my) / scale, py - (a * my - b * mx) / scale
    each = side / count
    return each * x, each * y, side / math.sqrt(scale), math.atan2(-b, a)
