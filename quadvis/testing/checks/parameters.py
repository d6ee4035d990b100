"""Checks that a block refuses bad parameters, and refuses them before a run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from quadvis.block import ANY, CABLE, Param, ParameterError
from quadvis.errors import QuadvisError
from quadvis.testing.rig import Subject, extreme_rigs


def refuses_bad_parameters(subject: Subject) -> None:
    """Check that a value beyond a bound, of another kind or missing is refused in the usual words."""
    subject.make()
    for name, param in subject.block.interface.params.items():
        for value in _bad_values(param):
            refusal = _refusal(subject, name, value)
            assert refusal is not None, f"{name} = {value!r} must be refused with ParameterError"
            named = refusal.parameter == name and str(refusal).startswith(f"{name} must be")
            assert named, f"for {name} = {value!r} say '{name} must be ...', not '{refusal}'"
        if param.required:
            assert _refusal(subject, name, None), f"a missing {name} must be refused"
    assert _refusal(subject, "no_such_parameter", 1.0), "an unknown parameter must be refused"


def _refusal(subject: Subject, name: str, value: Any) -> ParameterError | None:
    try:
        subject.make(**{name: value})
    except ParameterError as error:
        return error
    return None


def _bad_values(param: Param) -> Iterator[Any]:
    yield 1.0 if param.is_text else "no such choice"
    if param.is_port:
        yield CABLE
    if param.is_text or param.choices:
        return
    shape = param.signal.resolve({})
    if param.signal.shape != ANY:
        yield np.zeros((*shape, 2, 2)).tolist()
    numbers = [np.nan, *(bound for bound in (param.above, param.below) if bound is not None)]
    for bound, beyond in ((param.min, -np.inf), (param.max, np.inf)):
        if bound is not None:
            whole = param.signal.scalar == "int64"
            numbers.append(bound + np.sign(beyond) if whole else float(np.nextafter(bound, beyond)))
    for number in numbers:
        yield np.full(shape, number).tolist()


def refuses_before_a_run(subject: Subject) -> None:
    """Check that ``open`` and ``start`` refuse no parameter: ``quadvis check`` does not call them."""
    for name, value, rig in extreme_rigs(subject):
        try:
            with rig.engine:
                pass
        except QuadvisError as error:
            found = f"{name} = {value!r} stops a run before its first tick ({error})"
            raise AssertionError(f"{found}; refuse it in check") from None
