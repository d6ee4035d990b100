"""What the methods return, against what the block declares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from quadvis.block import Frame
from quadvis.engine.memory import Slot
from quadvis.testing.rig import STEPS, Subject, rigs, sources, targets


def returns_what_it_declares(subject: Subject) -> None:
    """Check that the methods return the declared number of values, of the declared kind and shape."""
    for rig in rigs(subject):
        placed, memory = rig.placed, rig.memory
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                for method, names in subject.block.interface.arguments.items():
                    slots = targets(placed, method)
                    if slots:
                        arguments = [memory.read(slot) for slot in sources(placed, names)]
                        _declared(method, getattr(rig.block, method)(*arguments), slots)
                rig.engine.run(1)


def _declared(method: str, returned: Any, slots: Mapping[str, Slot]) -> None:
    values = (returned,) if len(slots) == 1 else returned
    right = isinstance(values, tuple) and len(values) == len(slots)
    assert right, f"{method} must return {len(slots)} values, it returned {returned!r}"
    for value, (name, slot) in zip(values, slots.items(), strict=True):
        if slot.scalar == "frame":
            assert isinstance(value, Frame), f"{method} must return a Frame for {name}, not {value!r}"
            continue
        kinds = {"float64": "fiub", "int64": "iu", "bool": "b"}[slot.scalar]
        found = np.asarray(value)
        right = found.shape == slot.shape and found.dtype.kind in kinds
        wanted = f"{slot.scalar} of shape {slot.shape}" if slot.shape else slot.scalar
        assert right, f"{method} must return {wanted} for {name}, not {value!r}"
