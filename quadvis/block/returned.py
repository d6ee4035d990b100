"""Compare the values that a method of a block has returned with the declarations of its class."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from types import FrameType
from typing import Any, Protocol

import numpy as np

from quadvis.block.signals import Frame, Shape
from quadvis.machine.source_line import shown

CALL = "<call of a block>"  # file name, in tracebacks, of the code that calls blocks
KINDS = {"float64": "fiub", "int64": "iu", "bool": "b"}  # numpy's kinds that a slot takes without loss


class Holder(Protocol):
    """The destination of a value: its kind and its shape."""

    @property
    def scalar(self) -> str:
        """The kind: float64, int64, bool or frame."""

    @property
    def shape(self) -> Shape:
        """The length of each axis."""


def returned_fault(method: str, returned: Any, slots: Mapping[str, Holder]) -> str:
    """Return the fault in the result of a method for these slots; "" if there is none."""
    values = (returned,) if len(slots) == 1 else returned
    names = ", ".join(slots)
    if not isinstance(values, tuple) or len(values) != len(slots):
        found = str(len(values)) if isinstance(values, tuple) else repr(returned)
        return f"{method} must return {len(slots)} values ({names}), it returned {found}"
    for value, (name, slot) in zip(values, slots.items(), strict=True):
        if slot.scalar == "frame":
            if not isinstance(value, Frame):
                return f"{method} must return a Frame for {name}, it returned {value!r}"
            continue
        found = _array(value)
        if found is None or found.shape != slot.shape or found.dtype.kind not in KINDS[slot.scalar]:
            wanted = f"{slot.scalar} of shape {slot.shape}" if slot.shape else slot.scalar
            return f"{method} must return {wanted} for {name}, it returned {value!r}"
    return ""


def _array(value: Any) -> Any:
    try:
        return np.asarray(value)
    except ValueError:  # a list of lists of several lengths
        return None


def returned_wrongly(
    error: Exception, name: str, arguments: Sequence[Any], slots: Mapping[str, Holder]
) -> str:
    """Return the fault in the result of the method ``name``, with its place; "" if the result was right.

    The result is lost, so the method is called again, and the line that returns is recorded. A second call
    does no harm: ``output`` and ``deriv`` change nothing.
    """
    step = error.__traceback__
    while step is not None and step.tb_next is not None:
        step = step.tb_next
    if step is None or step.tb_frame.f_code.co_filename != CALL or not slots:
        return ""
    method: Callable[..., Any] = step.tb_frame.f_locals["method"]
    if method.__name__ != name:
        return ""
    returned, place = _watched(method, arguments)
    fault = returned_fault(method.__name__, returned, slots)
    return f"{fault} in {place}" if fault else ""


def _watched(method: Callable[..., Any], arguments: Sequence[Any]) -> tuple[Any, str]:
    """Return the result of a method, and the place of the line that returned it."""
    code = inspect.unwrap(method).__code__
    lines = [code.co_firstlineno]

    def watch(frame: FrameType, event: str, _: Any) -> None:
        if event == "return" and frame.f_code is code:
            lines.append(frame.f_lineno)

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        returned = method(*arguments)
    finally:
        sys.setprofile(before)
    return returned, f"{shown(code.co_filename)}:{lines[-1]}"
