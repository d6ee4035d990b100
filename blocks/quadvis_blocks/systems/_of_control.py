"""Parameters of blocks from the systems of python-control, which need not be installed."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.errors import QuadvisError


def polynomials_of(system: Any) -> dict[str, Any]:
    """Return the parameters of a transfer function; QuadvisError if it has several inputs or outputs."""
    if not system.issiso():
        counts = f"{system.ninputs} and {system.noutputs}"
        problem = f"a transfer function has one input and one output here, not {counts}"
        raise QuadvisError(f"{problem}; use systems.state_space")
    if not hasattr(system, "num"):
        import control

        system = control.ss2tf(system)
    numerator, denominator = (np.asarray(each[0][0], float).tolist() for each in (system.num, system.den))
    return {"numerator": numerator, "denominator": denominator} | method_of(system)


def method_of(system: Any) -> dict[str, Any]:
    """Return that a discrete system is discrete, and its period, if it is given."""
    if system.isctime(strict=False):
        return {}
    return {"method": "discrete"} | ({} if system.dt is True else {"period": float(system.dt)})


def roots_text(roots: Any) -> str:
    """Return zeros or poles as a text, to the bit."""
    return ", ".join(
        f"{root.real!r}{root.imag:+}j" if root.imag else repr(root.real) for root in map(complex, roots)
    )


def matrices_of(system: Any) -> dict[str, Any]:
    """Return the parameters of a system as matrices."""
    if not hasattr(system, "A"):
        import control

        system = control.tf2ss(system)
    found = {name: np.asarray(getattr(system, name), float) for name in "ABCD"}
    if not found["A"].size:  # a plain gain has no states: it gets one that nobody sees
        inputs, outputs = found["D"].shape[1], found["D"].shape[0]
        found |= {"A": np.zeros((1, 1)), "B": np.zeros((1, inputs)), "C": np.zeros((outputs, 1))}
    return {name: matrix.tolist() for name, matrix in found.items()}
