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

from quadvis_vision.camera.pinhole import Slopes
from quadvis_vision.camera.projection import camera_point, camera_rotation
from quadvis_vision.camera.vectors import Matrix, Vector, transposed, turned
from quadvis_vision.pose.circles import Circle
from quadvis_vision.pose.least_squares import Triangle, factored, solved, squares, undetermined
from quadvis_vision.pose.refine import Row, Unknowns, pose_of, slopes, weighed

Sines = tuple[float, float, float, float]  # sine and cosine of roll, sine and cosine of pitch


def level_pose(circles: list[Circle], roll: float, pitch: float, radius: float = 0.0) -> Unknowns | None:
    """Return the pose from circles and a finite tilt (rad); None if they give none.

    What is seen are the centres of the ellipses that the circles become; with a `radius` (m) above zero they
    are corrected to the images of the circles' centres.
    """
    pose = _fit(circles, roll, pitch, 0.0)
    for _ in range(2 if radius > 0 else 0):  # the correction needs the distance, and changes it a little
        if pose is not None:
            pose = _fit(circles, roll, pitch, radius / pose.z)
    return pose


def _fit(circles: list[Circle], roll: float, pitch: float, size: float) -> Unknowns | None:
    """Return the least squares pose; `size` is the radius of the circles in a level camera's picture."""
    tilt = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    mx = my = px = py = real = imaginary = spread = 0.0
    for circle in circles:
        x, y = _levelled(circle.x, circle.y, tilt, size)
        p, q = circle.forward, circle.right
        mx, my = mx + x, my + y
        px, py = px + p, py + q
        real += p * x + q * y
        imaginary += p * y - q * x
        spread += p * p + q * q
    count = len(circles)
    spread -= (px * px + py * py) / max(count, 1)
    if count < 2 or not spread > 0:
        return None
    a = (real - (px * mx + py * my) / count) / spread
    b = (imaginary - (px * my - py * mx) / count) / spread
    scale = a * a + b * b
    if not 0 < scale < math.inf:
        return None
    x, y = px - (a * mx + b * my) / scale, py - (a * my - b * mx) / scale
    return Unknowns(x / count, y / count, 1 / math.sqrt(scale), math.atan2(-b, a), roll, pitch)


def _levelled(x: float, y: float, tilt: Sines, size: float) -> tuple[float, float]:
    """Return m of a circle from the normalised centre of its ellipse; NaN if it is not above the camera.

    The centre of an ellipse is the pole of the picture's horizon. In level directions the horizon is the line
    sp cr forward - sr right = cp cr, and 1 / up is the centre's distance from it.
    """
    sr, cr, sp, cp = tilt
    w = sr * y + cr
    up = sp * x + cp * w
    if not 0 < up < math.inf:
        return math.nan, math.nan
    forward, right = (cp * x - sp * w) / up, (sr - cr * y) / up
    if size > 0:
        away, square = 1 / up, size * size
        rise = 4 * square * (sp * sp * cr * cr + sr * sr)
        shift = 2 * square / (away + math.sqrt(away * away + rise))
        forward, right = forward - shift * sp * cr, right + shift * sr
    return forward, right


def level_covariance(circles: list[Circle], unknowns: Unknowns, sigma: float) -> Triangle:
    """Return the covariance of x, y, z, yaw from `level_pose`; [] if the circles determine none.

    It is the triangle of 4 x 4, as in `quadvis_vision.pose.least_squares`. `sigma` (rad) is the standard
    deviation of roll and of pitch. The pose is linear in small errors of what is measured; each measured
    number contributes the square of what one standard deviation of it does to the pose.
    """
    pose = pose_of(unknowns)
    level = transposed(camera_rotation(unknowns.roll, unknowns.pitch, 0.0))
    fitted: list[Row] = []  # the derivatives of m by the unknowns
    by_pixels: list[Slopes] = []  # m by standard deviations of u and v
    for circle in circles:
        point = camera_point(pose.rotation, pose.position, circle.forward, circle.right)
        a, b, c, d = circle.weights
        area = a * d - b * c
        if not (point[2] > 0 and turned(level, point)[2] < 0 and abs(area) > 0):
            return undetermined()
        by_x, by_y = slopes(pose, point, unknowns.roll, 0.0, 0.0)
        p, q, r, s = _by_ray(level, point)
        fitted.append(weighed(by_x, p, by_y, q))
        fitted.append(weighed(by_x, r, by_y, s))
        by_pixels.append(
            ((p * d - q * c) / area, (q * a - p * b) / area, (r * d - s * c) / area, (s * a - r * b) / area)
        )
    factor = factored(squares(fitted, 4), 4)
    if not factor:
        return undetermined()
    # The right sides of the normal equations by one standard deviation of each measured number.
    sides: list[Row] = []
    by_roll = by_pitch = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for index in range(len(circles)):
        forward, right = fitted[2 * index], fitted[2 * index + 1]
        p, q, r, s = by_pixels[index]
        sides.append(weighed(forward, p, right, r))
        sides.append(weighed(forward, q, right, s))
        by_roll = weighed(by_roll, 1.0, weighed(forward, forward[4], right, right[4]), sigma)
        by_pitch = weighed(by_pitch, 1.0, weighed(forward, forward[5], right, right[5]), sigma)
    sides.append(by_roll)
    sides.append(by_pitch)
    found = [0.0] * len(factor)
    for side in sides:
        effect = solved(factor, side, 4)
        place = 0
        for i in range(4):
            for j in range(i + 1):
                found[place] += effect[i] * effect[j]
                place += 1
    return found


def _by_ray(level: Matrix, point: Vector) -> Slopes:
    """Return the derivatives of m of a point in camera axes by its normalised x and y, row by row."""
    (l11, l12, _), (l21, l22, _), (l31, l32, _) = level
    away = turned(level, point)
    forward, right, down = away[0] / away[2], away[1] / away[2], away[2] / point[2]
    return (
        (forward * l31 - l11) / down, (forward * l32 - l12) / down,
        (right * l31 - l21) / down, (right * l32 - l22) / down,
    )  # fmt: skip
