"""What a block makes of stamps that cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, rigs

HOSTILE = (1000.0, 0.7 * float(PERIOD), -1000.0, np.nan, np.inf, -np.inf)  # s, beside the right stamp
HOSTILE_AT = STEPS // 3  # the step at which it comes


def outlives_hostile_stamps(subject: Subject) -> None:
    """Check that a stamp that cannot be is as good as one that repeats, and that later good ones count.

    Stamps are the inputs called ``stamp`` or ``..._stamp``. One of them is ahead of the time, from long ago,
    NaN or infinite. From two samples later on the block must give the floats and flags that it gives when
    that stamp repeats the one before, since neither is news; counts and codes may tell the two apart.
    """
    names = [
        name
        for name, port in subject.block.interface.inputs.items()
        if (name == "stamp" or name.endswith("_stamp")) and str(port.signal) == "float64"
    ]
    for hostile in HOSTILE if names else ():
        for rig, other in zip(rigs(subject), rigs(subject), strict=True):
            spoilt = _stamped(rig, names, _good(HOSTILE_AT) + hostile)
            repeated = _stamped(other, names, _good(HOSTILE_AT - 1))
            for step, (found, wanted) in enumerate(zip(spoilt, repeated, strict=True)):
                if step < HOSTILE_AT + 2:
                    continue
                for name, value in wanted.items():
                    same = np.array_equal(found[name], value, equal_nan=True)
                    words = (
                        f"{step - HOSTILE_AT} samples after a stamp {_told(hostile)} {name} is {found[name]}"
                    )
                    assert same, f"{words}, not {value} as if that stamp were no news; it must not count"


def _good(step: int) -> float:
    """Return the stamp of what comes at a step, half a period old."""
    return float((step - Fraction(1, 2)) * PERIOD)


def _told(hostile: float) -> str:
    if not np.isfinite(hostile):
        return f"of {hostile}"
    return f"{abs(hostile):g} s {'ahead' if hostile > 0.0 else 'back'}"


def _stamped(rig: Rig, names: Sequence[str], stamp: float) -> list[dict[str, Any]]:
    """Run a block on good stamps but one; return its floats and flags at each step."""
    found = []
    memory, outputs = rig.memory, rig.placed.outputs
    slots = {name: slot for name, slot in outputs.items() if slot.scalar in ("float64", "bool")}
    with rig.engine:
        for step in range(STEPS):
            rig.series[step].update(dict.fromkeys(names, stamp if step == HOSTILE_AT else _good(step)))
            rig.feed(step)
            rig.engine.run(1)
            found.append({name: memory.read(slot) for name, slot in slots.items()})
    return found
