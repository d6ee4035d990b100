"""Independent solutions of the models in diagrams/textbook by scipy, python-control and closed forms.

Each takes the instants (s) and returns what the diagram must give there. The equations are those of the
sources that the diagrams name, not taken from the diagrams.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_continuous_are

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Any]


def solved(rates: Rates, start: Sequence[float], time: Array, breaks: Sequence[float] = ()) -> Array:
    """Return the states (N, n) at the instants; inputs jump at the breaks, where the solver begins anew."""
    found, begin, state = np.empty((len(time), len(start))), float(time[0]), np.array(start, float)
    for end in (*breaks, float(time[-1])):
        inside = (time >= begin) & (time < end)
        before = np.nextafter(end, begin)  # an input that jumps at the end has not yet jumped
        part = solve_ivp(
            lambda t, x, last=before: rates(min(t, last), x), (begin, end), state,
            "DOP853", t_eval=[*time[inside], end], rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        found[inside], begin, state = part.y[:, :-1].T, end, part.y[:, -1]
    found[-1] = state
    return found


def forced(system: Any, time: Array, inputs: Array) -> Array:
    """Return the output of a linear system of python-control whose inputs are held between the instants."""
    sampled = control.sample_system(control.ss(system), float(time[1]), method="zoh")
    return np.asarray(control.forced_response(sampled, time, inputs, squeeze=False).outputs).T


def step(time: Array, at: float = 0.0, height: float = 1.0) -> Array:
    """Return a step."""
    return np.where(time >= at - 1e-9, height, 0.0)


def vdp(time: Array) -> Array:
    return solved(lambda t, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], [2, 0], time)[:, 0]


def flight_control(time: Array) -> Array:
    """The angle of attack; the elevator stays within its limits."""
    s = control.tf("s")
    whole = (s + 0.6385) * (
        s + 0.6571
    ) + 0.00592 * 689.4  # of w' = Zw w + Uo q + Zd d, q' = Mw w + Mq q + Md d
    alpha = (-63.9979 * (s + 0.6571) - 6.8847 * 689.4) / whole / 689.4
    rate = (-6.8847 * (s + 0.6385) + 0.00592 * 63.9979) / whole
    felt = 0.677 / (0.3959 * s + 1) * alpha + 0.8156 * (s + 2.971) / (s + 4.144) * rate
    drive = (-1.746 - 3.864 / s) / (0.05 * s + 1)
    loop = drive * alpha / (1 + drive * felt) / (0.1 * s + 1)
    return forced(control.minreal(loop, 1e-9, verbose=False), time, step(time, 0.0, 0.5))[:, 0]


def cruise(time: Array) -> Array:
    s = control.tf("s")
    loop = (800 + 40 / s) / (1000 * s + 50)
    return forced(control.feedback(loop, 1), time, step(time, 0.0, 10.0))[:, 0]


def motor_speed(time: Array) -> Array:
    s = control.tf("s")
    motor = 0.01 / ((0.01 * s + 0.1) * (0.5 * s + 1) + 0.01**2)
    return forced(control.feedback(44 * (s + 1) / (s + 0.01) * motor, 1), time, step(time))[:, 0]


def train(time: Array) -> Array:
    def rates(t: float, x: Array) -> list[float]:
        force, spring = (1.0 if t < 20 else -1.0), x[0] - x[2]
        return [x[1], force - spring - 0.02 * 9.8 * x[1], x[3], (spring - 0.02 * 0.5 * 9.8 * x[3]) / 0.5]

    return solved(rates, [0, 0, 0, 0], time, [20.0])[:, 1]


def suspension(time: Array) -> Array:
    m1, m2, k1, k2, b1, b2 = 2500.0, 320.0, 80e3, 500e3, 350.0, 15020.0
    s = control.tf("s")
    body, wheel, spring = m1 * s**2, m2 * s**2 + b2 * s + k2, b1 * s + k1
    return forced((body + wheel) / (body * wheel + spring * (body + wheel)), time, step(time, 1.0))[:, 0]


def ball_and_beam(time: Array) -> Array:
    m, big_r, j, d, length, g = 0.111, 0.015, 9.99e-6, 0.03, 1.0, 9.8

    def rates(_: float, x: Array) -> list[float]:
        r, v, z = x  # z: of the lead, z' = -5 z + e and theta = 37.1 (e - 4.99 z)
        e = 0.25 - r
        dz = e - 5 * z
        alpha, dalpha = d / length * 37.1 * np.array([e - 4.99 * z, -v - 4.99 * dz])
        return [v, (m * g * math.sin(alpha) + m * r * dalpha**2) / (j / big_r**2 + m), dz]

    return solved(rates, [0, 0, 0], time)[:, 0]


def inverted_pendulum(time: Array) -> Array:
    big, m, b, ell, i, g = 0.5, 0.2, 0.1, 0.3, 0.006, 9.8

    def rates(t: float, x: Array) -> list[float]:
        v, _, w, a, total, slow = x
        error = math.pi - a
        push = 100 * error + total + 20 * (error - slow) / 0.01 + (100.0 if t < 0.01 else 0.0)
        matrix = [[big + m, m * ell * math.cos(a)], [m * ell * math.cos(a), i + m * ell**2]]
        right = [push - b * v + m * ell * w**2 * math.sin(a), -m * g * ell * math.sin(a)]
        acceleration, turning = np.linalg.solve(matrix, right)
        return [acceleration, v, turning, w, error, (error - slow) / 0.01]

    return solved(rates, [0, 0, 0, math.pi, 0, 0], time, [0.01])[:, 3]


def aircraft_pitch(time: Array) -> Array:
    a = np.array([[-0.313, 56.7, 0], [-0.0139, -0.426, 0], [0, 56.7, 0]])
    b = np.array([[0.232], [0.0203], [0]])
    gain = b.T @ solve_continuous_are(a, b, np.diag([0.0, 0.0, 50.0]), [[1.0]])
    assert np.allclose(gain, [[-0.6435, 169.6950, 7.0711]], rtol=1e-4)  # as the tutorial prints it
    system = control.ss(a - b @ gain, b, [[0, 0, 1]], 0)
    return forced(system, time, step(time, 0.0, 0.2))[:, 0]


def _car(
    time: Array,
    start: Sequence[float],
    driver: Callable[[float, Array], tuple[float, float]],
    breaks: Sequence[float] = (),
) -> Array:
    def rates(t: float, x: Array) -> list[float]:
        speed, steering = driver(t, x)
        return [speed * math.cos(x[2]), speed * math.sin(x[2]), speed * math.tan(steering)]

    return solved(rates, start, time, breaks)


def _round(angle: float) -> float:
    return (angle + math.pi) % (2 * math.pi) - math.pi


def bicycle(time: Array) -> Array:
    def driver(t: float, _: Array) -> tuple[float, float]:
        return 1.0, 0.5 if 3 <= t < 4 else -0.5 if 5 <= t < 6 else 0.0

    return _car(time, [0, 0, 0], driver, [3.0, 4.0, 5.0, 6.0])[:, :2]


def drive_to_point(time: Array) -> Array:
    def driver(_: float, x: Array) -> tuple[float, float]:
        right, up = 5 - x[0], 5 - x[1]
        steering = 4 * _round(math.atan2(up, right) - x[2])
        return 0.5 * math.hypot(right, up), min(max(steering, -0.45 * math.pi), 0.45 * math.pi)

    return _car(time, [5, 2, 0], driver)[:, :2]


def follow_line(time: Array) -> Array:
    def driver(_: float, x: Array) -> tuple[float, float]:
        distance = (x[0] - 2 * x[1] + 4) / math.sqrt(5)
        steering = _round(math.atan2(-1, -2) - x[2]) - 0.5 * distance
        return 0.5, min(max(steering, -0.45 * math.pi), 0.45 * math.pi)

    return _car(time, [5, 2, 0], driver)[:, :2]


def drive_to_pose(time: Array) -> Array:
    def driver(_: float, x: Array) -> tuple[float, float]:
        right, up = x[0] - 5, x[1] - 5
        rho, beta = math.hypot(right, up), -math.atan2(up, right)
        alpha = min(max(-x[2] - beta, -math.pi / 2), math.pi / 2)
        turn = -(5 * alpha - 2 * (beta + math.pi / 2))
        return max(-rho, -2.0), min(max(math.atan(turn / rho), -1.3), 1.3)

    return _car(time, [8, 5, math.pi / 2], driver)[:, :2]


def cartpole(time: Array) -> Array:
    big, m, ell, g, b = 1.0, 0.1, 0.5, 9.81, 10.0

    def rates(t: float, x: Array) -> list[float]:
        _, v, a, w = x
        force = (1.0 if 1 <= t < 1.2 else 0.0) - b * v
        matrix = [[big + m, m * ell * math.cos(a)], [m * ell * math.cos(a), m * ell**2]]
        right = [force + m * ell * w**2 * math.sin(a), m * g * ell * math.sin(a)]
        acceleration, turning = np.linalg.solve(matrix, right)
        return [v, acceleration, w, turning]

    return solved(rates, [0, 0, 0, 0], time, [1.0, 1.2])[:, 2]


def pi_control(time: Array) -> Array:
    s = control.tf("s")
    return forced(control.feedback((10 + 3 / s) * 0.5 / (2 * s + 1), 1), time, step(time, 1.0))[:, 0]


def sampled_loop(time: Array) -> Array:
    """The samples y[k+1] = a y[k] + (1 - a) 0.5 u[k], and exponentials between them."""
    found, y, u, last = [], 0.0, 0.0, 0.0
    for index, t in enumerate(time):
        y_now = y if index == 0 else 0.5 * u + (y - 0.5 * u) * math.exp(-(t - last) / 2)
        if index % 10 == 0:
            y, last, u = y_now, t, 10.0 * (float(t >= 1 - 1e-9) - y_now)
        found.append(y_now)
    return np.array(found)


def antenna(time: Array) -> Array:
    s = control.tf("s")
    return forced(control.feedback((10 * s + 1) / (s + 1) / (10 * s**2 + s), 1), time, step(time, 1.0))[:, 0]


def double_pendulum(time: Array) -> Array:
    def rates(_: float, x: Array) -> list[float]:
        a, w, c, v = x
        matrix = [[20 * 5, 10 * 5 * math.cos(a - c)], [10 * 5 * math.cos(a - c), 10 * 5]]
        bend = 10 * 5 * math.sin(a - c)
        right = [-bend * v**2 - 20 * 9.81 * math.sin(a), bend * w**2 - 10 * 9.81 * math.sin(c)]
        turning = np.linalg.solve(matrix, right)
        return [w, turning[0], v, turning[1]]

    return solved(rates, [-0.5, -1, 1, 2], time)[:, [0, 2]]


def three_masses(time: Array) -> Array:
    """The matrix exponential of the masses, with the sine and the constant as states beside them."""
    mass = np.diag([2.5, 2.0, 3.0])
    stiff = np.array([[30.0, -5, 0], [-5, 35, -30], [0, -30, 90]])
    damp = np.array([[3.0, -0.5, 0], [-0.5, 4, -3.5], [0, -3.5, 3.5]])
    whole = np.zeros((9, 9))  # places, speeds; 20 sin 120 t, 20 cos 120 t, 20
    whole[:3, 3:6] = np.eye(3)
    whole[3:6, :6] = np.linalg.solve(mass, np.hstack((-stiff, -damp)))
    whole[3, 6], whole[5, 8] = 1 / 2.5, 1 / 3.0
    whole[6, 7], whole[7, 6] = 120.0, -120.0
    state, over = np.array([0.0] * 7 + [20, 20]), expm(whole * time[1])
    return np.array([state, *(state := over @ state for _ in time[1:])])[:, :3]


def motor_pump(time: Array) -> Array:
    """The modes of three inertias with two shafts, in closed form."""
    stiff = np.array([[1200.0, -1200, 0], [-1200, 9200, -8000], [0, -8000, 8000]])
    root = np.diag(1 / np.sqrt([1.5, 4.5, 2.0]))
    squares, modes = np.linalg.eigh(root @ stiff @ root)
    begin = modes.T @ np.linalg.solve(root, [0.005, 0, 0])
    swings = begin * np.cos(np.outer(time, np.sqrt(np.maximum(squares, 0.0))))
    return swings @ (root @ modes).T


def robertson(time: Array) -> Array:
    def rates(_: float, x: Array) -> list[float]:
        slow, back, fast = 0.04 * x[0], 1e4 * x[1] * x[2], 3e7 * x[1] ** 2
        return [back - slow, slow - back - fast, fast]

    return solved(rates, [1, 0, 0], time)


MODELS: dict[str, tuple[str | tuple[str, ...], Callable[[Array], Array]]] = {
    "aircraft_pitch": ("aircraft.y[2]", aircraft_pitch),
    "antenna": ("antenna.y", antenna),
    "ball_and_beam": ("r.y", ball_and_beam),
    "bicycle": ("car.position", bicycle),
    "cartpole": ("angle.y", cartpole),
    "cruise": ("car.y", cruise),
    "double_pendulum": (("angle1.y", "angle2.y"), double_pendulum),
    "drive_to_point": ("car.position", drive_to_point),
    "drive_to_pose": ("car.position", drive_to_pose),
    "flight_control": ("aircraft.y[0]", flight_control),
    "follow_line": ("car.position", follow_line),
    "inverted_pendulum": ("angle.y", inverted_pendulum),
    "motor_pump": (("motor.y", "gear.y", "pump.y"), motor_pump),
    "motor_speed": ("speed.y", motor_speed),
    "pi_control": ("plant.y", pi_control),
    "robertson": (("a.y", "b.y", "c.y"), robertson),
    "sampled_loop": ("plant.y", sampled_loop),
    "suspension": ("car.y", suspension),
    "three_masses": ("masses.y", three_masses),
    "train": ("v1.y", train),
    "vdp": ("x1.y", vdp),
}
"""By diagram: the signals that are compared, and their solution; columns are elements, or signals."""
