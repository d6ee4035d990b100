"""Linear systems as objects of python-control, for further design."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from quadvis.analysis.linearise import Linear
from quadvis.analysis.probe import Matrix
from quadvis.errors import QuadvisError


def library(name: str = "control") -> Any:
    """Import python-control, or a module of scipy that comes with it; QuadvisError says how to install it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise QuadvisError(f"python-control is needed, but {error}; run 'pip install control'") from None


def state_space(linear: Linear, a: Matrix, b: Matrix, c: Matrix, d: Matrix) -> Any:
    """Return a `control.StateSpace` with names of states and channels; dt is the hyperperiod if lifted."""
    names = [_name(channel.text, channel.read, channel.time, linear) for channel in linear.channels]
    return named_system(
        (a, b, c, d), linear.period, linear.states,
        [f"{name} in" for name in names], [f"{name} out" for name in names],
    )  # fmt: skip


def named_system(
    matrices: tuple[Matrix, Matrix, Matrix, Matrix],
    period: float,
    states: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
) -> Any:
    """Return a `control.StateSpace`.

    The names have ':' where diagrams have '.', because python-control reserves the '.'.
    """
    plain = [[name.replace(".", ":") for name in names] for names in (states, inputs, outputs)]
    return library().StateSpace(*matrices, period, states=plain[0], inputs=plain[1], outputs=plain[2])


def instant_names(text: str, times: Sequence[float]) -> list[str]:
    """Return the names of a number at the instants of a hyperperiod; its own name if there is one instant."""
    return [text] if len(times) == 1 else [f"{text} @ {_ticks(time)}" for time in times]


def closed_loop(linear: Linear) -> Any:
    """Return the closed loop, from the disturbances of the cut signals to the signals without disturbance."""
    return state_space(linear, linear.a, linear.b, linear.c, linear.d)


def _name(text: str, place: int, time: float, linear: Linear) -> str:
    places = sorted({channel.read for channel in linear.channels if channel.text == text})
    element = f"({places.index(place)})" if len(places) > 1 else ""
    name = f"{text}{element}"
    return f"{name} @ {_ticks(time)}" if linear.period else name


def _ticks(time: float) -> str:
    return f"{1e6 * time:.0f} us"
