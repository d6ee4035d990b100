"""A PID controller."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State, clip, element
from quadvis_blocks._limits import refuse_reversed

CONTINUOUS, FORWARD, BACKWARD, TRAPEZOIDAL = range(4)
CLAMPING, BACK_CALCULATION, NONE = range(3)
INTEGRAL, OUTPUT = range(2)


class Pid(Block):
    """A PID controller in parallel form, for a scalar, or for each element of an array.

    ``free = kp (b r - m) + ki integral(r - m) + kd s / (filter_time s + 1) (c r - m)``, with the reference r
    and the measurement m; ``y`` is this within the limits. With c = 0, the default, a step of the reference
    does not kick the derivative; b = c = 1 is the textbook's PID on the error. ``filter_time`` is 1/N.
    With the times of the standard form, ``ki = kp / Ti`` and ``kd = kp Td``.
    At a rate the integrals, that of the filter too, are sums: of the samples up to the last one (forward), up
    to the present one (backward), or of means (trapezoidal). ``continuous`` leaves them to the solver and
    needs no ``rate``.

    At a limit the integral does not wind up. ``clamping``: it stands still while it would drive the output
    further beyond the limit. ``back_calculation``: its rate is ``ki (r - m) + kb (y - free)``.

    While ``manual`` is true the output is ``command`` within the limits, and the rest of the controller
    follows: at the first tick after it the output is the last command, whatever the error is then, and goes
    on from there. It is the integral part that gives way, so with ki = 0 the output jumps. ``initial`` with
    ``begin: output`` does the same for the first tick.

    Sources: K. J. Astrom, T. Hagglund, Advanced PID Control, chapters 3 and 13.
    """

    kp = Param(1.0, type="float64[*?]", unit="b/a", tune=True, shown=True, doc="proportional gain")
    ki = Param(0.0, type="float64[*?]", unit="b/a/s", tune=True, shown=True, doc="integral gain")
    kd = Param(0.0, type="float64[*?]", unit="b*s/a", tune=True, shown=True, doc="derivative gain")
    filter_time = Param(
        0.0, unit="s", min=0.0, tune=True, doc="time constant of the derivative's filter, 1/N"
    )
    b = Param(1.0, tune=True, doc="set-point weight of the proportional part")
    c = Param(0.0, tune=True, doc="set-point weight of the derivative part")
    lower = Param(-math.inf, type="float64[*?]", unit="b", tune=True, doc="smallest output")
    upper = Param(math.inf, type="float64[*?]", unit="b", tune=True, doc="largest output")
    anti_windup = Param(
        "clamping", choices=("clamping", "back_calculation", "none"), doc="what the integral does at a limit"
    )
    kb = Param(1.0, unit="1/s", min=0.0, tune=True, doc="gain of the back-calculation")
    method = Param(
        "backward",
        choices=("continuous", "forward", "backward", "trapezoidal"),
        doc="continuous, or the rule of the sums",
    )
    initial = Param(0.0, type="float64[*?]", unit="b", doc="where it begins")
    begin = Param("integral", choices=("integral", "output"), doc="what begins there")
    reference = In("float64[*]", unit="a", doc="r, the set-point")
    measurement = In("float64[*]", unit="a", doc="m, what is controlled")
    manual = In("bool", default=False, doc="true to take the command")
    command = In("float64[*]", unit="b", default=0.0, doc="the output in manual mode")
    y = Out("float64[*]", unit="b", doc="the output, within the limits")
    free = Out("float64[*]", unit="b", doc="the output before the limits")
    integral = State("float64[*]", doc="the integral part")
    slow = State("float64[*]", doc="what the derivative's filter has reached")
    last = State("float64[*]", doc="the last output in manual mode")
    follows = State("bool", doc="whether the next output is the last one of manual mode")
    fresh = State("bool", doc="whether the filter begins with what it gets")

    example = """
        speed: {block: sources.constant, rate: fast, with: {value: 10 rad/s}}
        wanted: {block: sources.step, rate: fast, with: {after: 12 rad/s, at: 0.2 s}}
        control:
          block: systems.pid
          rate: fast
          with: {kp: 0.5 V*s/rad, ki: 2 V/rad, lower: -6 V, upper: 6 V}
          in: {reference: wanted.y, measurement: speed.y}
    """

    @classmethod
    def ports(cls, method: int) -> dict[str, Any]:
        """Return states for the solver, if the method leaves them to it."""
        if method != CONTINUOUS:
            return {}
        states = {
            name: State("float64[*]", continuous=True, doc=state.doc) for name, state in _SOLVED.items()
        }
        return {**states, "deriv": _deriv}

    def check(self) -> None:
        """Refuse limits that exclude each other, and a derivative without a filter that suits the method."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper))
        if not np.any(self.kd):
            return
        least = 0.5 * self.period if self.method == FORWARD else 0.0
        if self.filter_time < least or (self.filter_time == 0.0 and self.method != BACKWARD):
            words = f"at least {least:g} s, half the period," if least > 0.0 else "above 0 s"
            problem = f"filter_time must be {words} where kd is not 0, got {self.filter_time:g} s"
            raise ParameterError("filter_time", problem)

    def start(self) -> None:
        """Begin with the initial value."""
        self.integral = self.initial
        self.last = self.initial
        self.follows = self.begin == OUTPUT
        self.fresh = self.begin == OUTPUT

    def output(self, reference: Any, measurement: Any, manual: bool, command: Any) -> Any:
        """Return the output within the limits, and before them."""
        if isinstance(reference, float):
            return _given(self, 0, reference, measurement, manual, command)
        y, free = np.empty_like(reference), np.empty_like(reference)
        for index in range(y.size):
            r, m = reference.flat[index], measurement.flat[index]
            y.flat[index], free.flat[index] = _given(self, index, r, m, manual, command.flat[index])
        return y, free

    def update(self, reference: Any, measurement: Any, manual: bool, command: Any) -> None:
        """Go on by one sample; in manual mode keep the command."""
        if isinstance(reference, float):
            self.integral, self.slow, self.last = _next(self, 0, reference, measurement, manual, command)
        else:
            for index in range(reference.size):
                r, m = reference.flat[index], measurement.flat[index]
                integral, slow, last = _next(self, index, r, m, manual, command.flat[index])
                self.integral.flat[index], self.slow.flat[index], self.last.flat[index] = integral, slow, last
        self.follows = manual
        self.fresh = False


_SOLVED = {"integral": Pid.integral, "slow": Pid.slow}


def _deriv(self: Any, reference: Any, measurement: Any, manual: bool) -> Any:
    """Return the rates of the integral part and of the derivative's filter."""
    if isinstance(reference, float):
        return _rates(self, 0, reference, measurement, manual)
    integral, slow = np.empty_like(reference), np.empty_like(reference)
    for index in range(reference.size):
        rates = _rates(self, index, reference.flat[index], measurement.flat[index], manual)
        integral.flat[index], slow.flat[index] = rates
    return integral, slow


def _lead(block: Any) -> float:
    """Return how much of the present sample is in the integrals (s)."""
    if block.method == BACKWARD:
        return float(block.period)
    return 0.5 * block.period if block.method == TRAPEZOIDAL else 0.0


def _beside(block: Any, index: int, r: float, m: float) -> tuple[float, float]:
    """Return the output without the integral state, and the derivative part of it."""
    lead = _lead(block)
    fast = element(block.kd, index) * (block.c * r - m)
    slow = fast if block.fresh else element(block.slow, index)
    lag = block.filter_time + lead
    derivative = (fast - slow) / lag if lag > 0.0 else 0.0
    proportional = element(block.kp, index) * (block.b * r - m)
    return proportional + derivative + lead * element(block.ki, index) * (r - m), derivative


def _held(block: Any, index: int, value: float) -> float:
    return float(clip(value, element(block.lower, index), element(block.upper, index)))


def _integral(block: Any, index: int, beside: float) -> float:
    """Return the integral state, or that with which the output is the last one of manual mode."""
    if block.follows and element(block.ki, index) != 0.0:
        return float(element(block.last, index) - beside)
    return float(element(block.integral, index))


def _given(block: Any, index: int, r: float, m: float, manual: bool, command: float) -> tuple[float, float]:
    beside, _ = _beside(block, index, r, m)
    free = beside + _integral(block, index, beside)
    return _held(block, index, command if manual else free), free


def _rate(block: Any, index: int, error: float, free: float) -> float:
    """Return the rate of the integral part."""
    ki = element(block.ki, index)
    rate, beyond = ki * error, free - _held(block, index, free)
    if block.anti_windup == CLAMPING:
        return 0.0 if rate * beyond > 0.0 else rate
    if block.anti_windup == BACK_CALCULATION and ki != 0.0:
        return float(rate - block.kb * beyond)
    return float(rate)


def _rates(block: Any, index: int, r: float, m: float, manual: bool) -> tuple[float, float]:
    beside, derivative = _beside(block, index, r, m)
    rate = 0.0 if manual else _rate(block, index, r - m, beside + _integral(block, index, beside))
    return rate, derivative


def _next(
    block: Any, index: int, r: float, m: float, manual: bool, command: float
) -> tuple[float, float, float]:
    """Return the integral part, the filter's state and the last command after a sample."""
    beside, derivative = _beside(block, index, r, m)
    integral = _integral(block, index, beside)
    fast = element(block.kd, index) * (block.c * r - m)
    slow = fast if block.fresh else element(block.slow, index)
    last = _held(block, index, command) if manual else element(block.last, index)
    if block.method == CONTINUOUS:
        return integral, slow, last
    if not manual:
        moved = integral + block.period * _rate(block, index, r - m, beside + integral)
        if block.anti_windup == CLAMPING:  # no further than to the limit
            least = min(integral, element(block.lower, index) - beside)
            moved = float(clip(moved, least, max(integral, element(block.upper, index) - beside)))
        integral = moved
    return integral, slow + block.period * derivative, last
