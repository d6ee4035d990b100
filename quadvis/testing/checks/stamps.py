"""The check that impossible stamps do not harm a block."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, rigs

HOSTILE = (1000.0, 0.7 * float(PERIOD), -1000.0, np.nan, np.inf, -np.inf)  # s, added to the right stamp
HOSTILE_AT = STEPS // 3  # the step at which the hostile stamp comes


def outlives_hostile_stamps(subject: Subject) -> None:
    """Check that an impossible stamp acts like a repeated stamp, and that later good stamps count.

    Stamps are the inputs called ``stamp`` or ``..._stamp``. In one run, the stamp of one step is ahead of
    the time, from long ago, NaN or infinite. In the other run, the stamp of that step repeats the stamp of
    the step before. Neither is news. So, two samples later and from then on, both runs must give the same
    floats and flags; whole numbers, such as counts and codes, may differ.
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
                        f"{step - HOSTILE_AT} samples after a stamp {_words(hostile)} {name} is {found[name]}"
                    )
                    assert same, f"{words}, not {value} as if that stamp were no news; it must not count"


def _good(step: int) -> float:
    """Return the right stamp for a step: the instant half a period before the step."""
    return float((step - Fraction(1, 2)) * PERIOD)


def _words(hostile: float) -> str:
    if not np.isfinite(hostile):
        return f"of {hostile}"
    return f"{abs(hostile):g} s {'ahead' if hostile > 0.0 else 'back'}"


def _stamped(rig: Rig, names: Sequence[str], stamp: float) -> list[dict[str, Any]]:
    """Run a block with right stamps, except one; return its floats and flags at each step."""
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
