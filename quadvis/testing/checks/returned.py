"""The check that the results of the methods fit the declarations of the block."""

from __future__ import annotations

from quadvis.block.returned import returned_fault
from quadvis.testing.rig import STEPS, Subject, rigs, sources, targets


def returns_what_it_declares(subject: Subject) -> None:
    """Check that the methods return the declared number of values, of the declared kind and shape."""
    for rig in rigs(subject):
        placed, memory = rig.placed, rig.memory
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                for method, names in rig.interface.arguments.items():
                    slots = targets(placed, method)
                    if slots:
                        arguments = [memory.read(slot) for slot in sources(placed, names)]
                        fault = returned_fault(method, getattr(rig.block, method)(*arguments), slots)
                        assert not fault, fault
                rig.engine.run(1)
