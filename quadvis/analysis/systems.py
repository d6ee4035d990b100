"""Linear systems as objects of python-control, for further design."""

from __future__ import annotations

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
    """Return a `control.StateSpace` with names of states and channels; dt is the hyperperiod if lifted.

    The names have ':' where diagrams have '.', because python-control reserves the '.'.
    """
    names = [_name(channel.text, channel.read, channel.time, linear) for channel in linear.channels]
    return library().StateSpace(
        a, b, c, d, linear.period,
        states=[name.replace(".", ":") for name in linear.states],
        inputs=[f"{name} in" for name in names],
        outputs=[f"{name} out" for name in names],
    )  # fmt: skip


def closed_loop(linear: Linear) -> Any:
    """Return the closed loop, from the disturbances of the cut signals to the signals without disturbance."""
    return state_space(linear, linear.a, linear.b, linear.c, linear.d)


def _name(text: str, place: int, time: float, linear: Linear) -> str:
    places = sorted({channel.read for channel in linear.channels if channel.text == text})
    element = f"({places.index(place)})" if len(places) > 1 else ""
    name = f"{text}{element}".replace(".", ":")
    return f"{name} @ {_ticks(time)}" if linear.period else name


def _ticks(time: float) -> str:
    return f"{1e6 * time:.0f} us"
