"""Three tasks for programs that run block diagrams, and what comes out of them.

a: the hover of the paper, equations (11) to (23), with the controller each 50 ms and the plant by the
classical Runge-Kutta formula at 1 ms. b: the same loop at 1 kHz in exactly 30 blocks, the plant by Euler's
method. c: a chain of gains and unit delays at 1 kHz behind a constant.

Only the standard library is needed here: other programs import this module in their own environment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple

STEP = 1e-3  # s
SUBSTEPS = 50  # steps of the solver in one period of task a's controller
PERIOD = 0.05  # s
MASS, GRAVITY = 0.5, 9.81  # kg, m/s^2
HEIGHT_GAIN, YAW_GAIN = 2.0, 4.0  # of the error and of its rate alike
HEIGHT = 1.0  # m, wanted
LIMITS = (2.0, 0.9, 0.4, 0.19)  # of the nested saturations, the outermost first
FACTOR = 0.999  # of each gain in the chain
# x, y, z (m), psi, theta, phi (rad), and their rates; 1 m and 0.2 rad away from the wanted pose.
START = (1.0, 1.0, HEIGHT + 1.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STATES = ("x", "y", "z", "psi", "theta", "phi", "vx", "vy", "vz", "wpsi", "wtheta", "wphi")
COMMANDS = ("thrust", "yaw", "pitch", "roll")

Values = Sequence[float]


# The loop, in floats


def slopes(s: Values, u: Values) -> tuple[float, ...]:
    """Return the derivatives of the 12 states: equations (11) to (16)."""
    pull = u[0] / MASS
    level = pull * cos(s[4])
    return (
        s[6], s[7], s[8], s[9], s[10], s[11],
        -pull * sin(s[4]), level * sin(s[5]), level * cos(s[5]) - GRAVITY, u[1], u[2], u[3],
    )  # fmt: skip


def law(s: Values) -> tuple[float, float, float, float]:
    """Return thrust (N) and the three torques: equations (17) to (23)."""
    x, y, z, psi, theta, phi, vx, vy, vz, wpsi, wtheta, wphi = s
    thrust = -HEIGHT_GAIN * vz - HEIGHT_GAIN * (z - HEIGHT) + MASS * GRAVITY
    yaw = -YAW_GAIN * wpsi - YAW_GAIN * psi
    return (
        thrust / (cos(theta) * cos(phi)), yaw, nested(wtheta, theta, -vx, -x), nested(wphi, phi, vy, y),
    )  # fmt: skip


def nested(rate: float, angle: float, speed: float, place: float) -> float:
    """Return the torque of the nested saturations."""
    outer, third, second, inner = LIMITS
    part = limited(rate + 3.0 * angle + 3.0 * speed / GRAVITY + place / GRAVITY, inner)
    part = limited(rate + 2.0 * angle + speed / GRAVITY + part, second)
    part = limited(rate + angle + part, third)
    return -limited(rate + part, outer)


def limited(value: float, limit: float) -> float:
    """Return the value within plus and minus the limit."""
    return -limit if value < -limit else limit if value > limit else value


def runge_kutta(s: Values, u: Values) -> list[float]:
    """Return the states one step later, by the classical formula."""
    k1 = slopes(s, u)
    k2 = slopes([a + 0.5 * STEP * b for a, b in zip(s, k1, strict=True)], u)
    k3 = slopes([a + 0.5 * STEP * b for a, b in zip(s, k2, strict=True)], u)
    k4 = slopes([a + STEP * b for a, b in zip(s, k3, strict=True)], u)
    return [
        a + STEP / 6.0 * (p + 2.0 * q + 2.0 * r + w) for a, p, q, r, w in zip(s, k1, k2, k3, k4, strict=True)
    ]


def euler(s: Values, u: Values) -> list[float]:
    """Return the states one step later, by Euler's method."""
    return [a + STEP * b for a, b in zip(s, slopes(s, u), strict=True)]


# Diagrams as data


class Part(NamedTuple):
    """One block: its name, its kind, its numbers, and its inputs as pairs of a block and a port."""

    name: str
    kind: str
    numbers: tuple[float, ...]
    inputs: tuple[tuple[str, int], ...]


def thirty() -> list[Part]:
    """Return the 30 blocks of task b.

    Kinds: ``plant`` (Euler, 12 outputs in one signal), ``demux``, ``mux``, ``weighted`` (sum of its inputs by
    weights), ``saturation`` (between plus and minus a limit), ``gain``, ``constant``, ``thrust`` ((force +
    weight) / (cos theta cos phi)), ``delay`` (of one sample, with its initial value).
    """
    found = [
        Part("plant", "plant", (), (("mux", 0),)), Part("demux", "demux", (12,), (("plant", 0),)),
    ]  # fmt: skip
    signals = {name: ("demux", index) for index, name in enumerate(STATES)}
    for axis, sign, names in (
        ("pitch", -1.0, ("wtheta", "theta", "vx", "x")), ("roll", 1.0, ("wphi", "phi", "vy", "y"))
    ):  # fmt: skip
        g = sign / GRAVITY
        inner: tuple[tuple[str, int], ...] = ()
        stages = ((1.0, 3.0, 3.0 * g, g), (1.0, 2.0, g), (1.0, 1.0), (1.0,))
        for weights, limit in zip(stages, reversed(LIMITS), strict=True):
            number = len(weights)
            inputs = (*(signals[name] for name in names[:number]), *inner)
            found.append(Part(f"{axis}_sum{number}", "weighted", weights + (1.0,) * len(inner), inputs))
            found.append(Part(f"{axis}_limit{number}", "saturation", (limit,), ((f"{axis}_sum{number}", 0),)))
            inner = ((f"{axis}_limit{number}", 0),)
        found.append(Part(axis, "gain", (-1.0,), inner))
    height, yaw = HEIGHT_GAIN, YAW_GAIN
    found += [
        Part("height", "constant", (HEIGHT,), ()),
        Part("force", "weighted", (-height, -height, height), (signals["vz"], signals["z"], ("height", 0))),
        Part("thrust", "thrust", (MASS * GRAVITY,), (("force", 0), signals["theta"], signals["phi"])),
        Part("heading", "constant", (0.0,), ()),
        Part("yaw", "weighted", (-yaw, -yaw, yaw), (signals["wpsi"], signals["psi"], ("heading", 0))),
    ]
    found += [Part(f"late_{name}", "delay", (0.0,), ((name, 0),)) for name in COMMANDS]
    return [*found, Part("mux", "mux", (4,), tuple((f"late_{name}", 0) for name in COMMANDS))]


def chain(count: int) -> list[Part]:
    """Return a constant and then, in turn, a gain and a unit delay, ``count`` in all."""
    found, last = [Part("one", "constant", (1.0,), ())], "one"
    for index in range(count // 2):
        found.append(Part(f"gain{index}", "gain", (FACTOR,), ((last, 0),)))
        last = f"delay{index}"
        found.append(Part(last, "delay", (0.0,), ((f"gain{index}", 0),)))
    return found


def reached(count: int, steps: int) -> list[int]:
    """Return the number of the last delay that a run of so many steps has reached, and the next one, if any.

    Before the run every delay gives zero; after it the first gives what one gain makes, and so on.
    """
    return [index for index in (min(steps, count // 2) - 1, steps) if index < count // 2]


def front(count: int, steps: int) -> list[str]:
    """Return the names of the delays that are `reached`."""
    return [f"delay{index}" for index in reached(count, steps)]


# The tasks


@dataclass(frozen=True)
class Task:
    """One task: a, b, or c with its number of blocks."""

    letter: str
    count: int = 0

    @staticmethod
    def named(name: str) -> Task:
        """Return the task of a name such as ``a`` or ``c100``."""
        return Task(name[0], int(name[1:] or 0))

    @property
    def name(self) -> str:
        """The name that `named` reads."""
        return self.letter + (str(self.count) if self.count else "")

    @property
    def blocks(self) -> int:
        """How many blocks run at each step; 0 for task a, whose time is given by the second."""
        return {"a": 0, "b": 30, "c": self.count}[self.letter]

    @property
    def check(self) -> int:
        """After how many steps the values are compared: in a and b the loop is in full motion then."""
        return 5000 if self.letter != "c" else min(20, self.count // 2 - 1)

    @property
    def most(self) -> int:
        """The largest number of steps: after 100 s the states of a and b become denormal, which is slow."""
        return 10_000_000 if self.letter == "c" else 100_000

    def expected(self, steps: int) -> list[float]:
        """Return what comes out: the 12 states in a and b, the outputs at the `front` in c.

        Task a needs scipy.
        """
        if self.letter == "a":
            return exact(steps)
        if self.letter == "b":
            return by_definition(steps)
        return [FACTOR ** (index + 1) if index < steps else 0.0 for index in reached(self.count, steps)]

    @property
    def tolerance(self) -> float:
        """By how much the values may differ: in a the formulas differ, in b and c only the rounding."""
        return 1e-9 if self.letter == "a" else 1e-12


def exact(steps: int) -> list[float]:
    """Return the states of task a by Dormand and Prince's formula of order 8, restarted at each sample."""
    from scipy.integrate import solve_ivp

    s = list(START)
    for begin in range(0, steps, SUBSTEPS):
        u, duration = law(s), STEP * min(SUBSTEPS, steps - begin)
        rates: Callable[..., object] = lambda _, y, u=u: slopes(y, u)  # noqa: E731
        s = solve_ivp(rates, (0.0, duration), s, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1].tolist()
    return s


def by_definition(steps: int) -> list[float]:
    """Return the states of task b; the four delays begin at zero."""
    s, held = list(START), (0.0, 0.0, 0.0, 0.0)
    for _ in range(steps):
        s, held = euler(s, held), law(s)
    return s


def parts(task: Task) -> Iterator[Part]:
    """Yield the blocks of task b or c."""
    yield from thirty() if task.letter == "b" else chain(task.count)
