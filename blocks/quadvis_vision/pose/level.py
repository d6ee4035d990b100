"""The camera's pose when its tilt is known: position and yaw in closed form from two circles or more.

Rays that are turned back by roll and pitch see the target as a camera that looks straight up does, which is
as a similarity. In level axes, forward and right at unit distance, circle i with the centre P_i appears at

    m_i = [a -b; b a] P_i + c,    a + i b = exp(-i yaw) / z,

linear in a, b and the two numbers of c. So two circles are enough, and nothing is ambiguous. Frames and signs
are those of `_pose`.
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

# Corners 1..4 of the square of side 1 in target axes: forward and right of its middle.
_CORNERS = ((-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5))


def level_pose(points: Array, roll: float, pitch: float, side: float, radius: float = 0.0) -> Level | None:
    """Return the pose from normalised points (4, 2), NaN rows missing, and a finite tilt (rad); None if none.

    The points are the centres of the ellipses that the circles become; with a `radius` (m) above zero their
    distance from the images of the circles' centres is taken out.
    """
    pose = _fit(points, roll, pitch, side, 0.0)
    if not radius:
        return pose
    for _ in range(2):  # the distance says how large a circle looks, and that moves the distance a little
        if pose is None:
            return None
        pose = _fit(points, roll, pitch, side, (radius / pose[2]) ** 2)
    return pose


@np.errstate(all="ignore")
def level_covariance(view: View, unknowns: Array, sigma: float) -> Array | None:
    """Return the covariance (4, 4) of x, y, z, yaw from `level_pose`; None if nothing determines them.

    `view` has the points that are not missing and how sure they are, `unknowns` (6,) are the pose's x, y, z,
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


def _fit(points: Array, roll: float, pitch: float, side: float, size: float) -> Level | None:
    """Return the least squares pose; `size` is the square of the radius that a level camera sees.

    Plain numbers: on four points they are several times faster than arrays or complex numbers.
    """
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    count = mx = my = px = py = real = imaginary = 0.0
    for (x, y), (p, q) in zip(points.tolist(), _CORNERS):  # noqa: B905  # strict takes a tenth of the time
        w = sr * y + cr
        up = sp * x + cp * w
        if up > 0:
            forward, right = (cp * x - sp * w) / up, (sr - cr * y) / up
            if size:
                # The centre of an ellipse is the pole of the picture's horizon, in level directions the line
                # sp cr forward - sr right = cp cr, and 1 / up says how far the centre is from it.
                rise = 4 * size * (sp * sp * cr * cr + sr * sr)
                shift = 2 * size / (1 / up + math.sqrt(1 / (up * up) + rise))
                forward -= shift * sp * cr
                right += shift * sr
            count += 1.0
            mx += forward
            my += right
            px += p
            py += q
            real += p * forward + q * right
            imaginary += p * right - q * forward
        elif up <= 0:
            return None
    if count < 2:
        return None
    spread = 0.5 * count - (px * px + py * py) / count
    a = (real - (px * mx + py * my) / count) / spread
    b = (imaginary - (px * my - py * mx) / count) / spread
    scale = a * a + b * b
    if not 0 < scale < math.inf:
        return None
    x, y = px - (a * mx + b * my) / scale, py - (a * my - b * mx) / scale
    each = side / count
    return each * x, each * y, side / math.sqrt(scale), math.atan2(-b, a)
