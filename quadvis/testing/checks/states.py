"""Checks that only the right methods change states, and that later outputs depend on nothing but states."""

from __future__ import annotations

from typing import Any

from quadvis.block import OUTSIDE
from quadvis.engine.engine import Snapshot
from quadvis.testing.rig import STEPS, Rig, Subject, rigs, sources


def starts_the_same(subject: Subject) -> None:
    """Check that ``start`` gives the same states after any run as before the first run."""
    for rig, again in zip(rigs(subject), rigs(subject), strict=True):
        initial = rig.engine.snapshot()
        with rig.engine, again.engine:
            started = rig.record()
            assert again.record() == started, "two blocks with the same seed start differently"
            rig.run(range(STEPS))
            rig.engine.restore(initial)
            if "start" in rig.interface.arguments:
                rig.block.start()
            assert rig.record() == started, "start after a run gives other states; keep nothing in attributes"


def output_changes_nothing(subject: Subject) -> None:
    """Check that two calls of ``output`` give the same results, and change no parameter and no state."""
    for rig in rigs(subject):
        output = rig.call("output")
        if output is None:
            continue
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                before = rig.record()
                output()
                first = rig.contents()
                output()
                assert rig.record() == before, f"output changed a state at step {step}; only update may"
                assert rig.contents() == first, f"output gave two answers at step {step}"
                rig.engine.run(1)


def work_is_of_one_tick(subject: Subject) -> None:
    """Check that Work of an earlier tick has no effect, and that Work has no effect on ``deriv``."""
    if not subject.block.interface.work:
        return
    for rig, other in zip(rigs(subject), rigs(subject), strict=True):
        with rig.engine, other.engine:
            for step in range(STEPS):
                rig.feed(step)
                other.feed(step)
                other.spoil_work()
                derive, derive_other = rig.call("deriv"), other.call("deriv")
                if derive is not None and derive_other is not None:
                    derive()
                    derive_other()
                    same = rig.contents() == other.contents()
                    assert same, f"deriv reads Work at step {step}; only update may"
                rig.engine.run(1)
                other.engine.run(1)
                same = rig.contents() == other.contents()
                assert same, f"at step {step} Work was read before output wrote it; keep in states what lasts"


def outside_changes_nothing(subject: Subject) -> None:
    """Check that ``read`` and ``write`` return nothing, and change no parameter and no state.

    ``write`` must accept the safe values, too.
    """
    arguments = subject.block.interface.arguments
    for rig in rigs(subject) if not arguments.keys().isdisjoint(OUTSIDE) else ():
        memory = rig.memory
        with rig.engine:
            for step in range(STEPS):
                before = rig.record()
                rig.feed(step)
                for method in ("read", "output", "write"):
                    if method in arguments:
                        values = [memory.read(slot) for slot in sources(rig.placed, arguments[method])]
                        returned = getattr(rig.block, method)(*values)
                        assert method == "output" or returned is None, f"{method} must return nothing"
                        assert rig.record() == before, (
                            f"{method} changed a state at step {step}; only update may"
                        )
                rig.engine.run(1)
            rig.block.write_safe(rig.engine.time)


def inputs_not_asked_for_do_not_matter(subject: Subject) -> None:
    """Check that the results of ``output`` depend only on the inputs that it asks for."""
    for rig in rigs(subject):
        output, memory = rig.call("output"), rig.memory
        others = set(rig.interface.inputs) - rig.interface.feedthrough
        if output is None or not others:
            continue
        with rig.engine:
            for step in range(1, STEPS):
                rig.feed(step)
                for name in others:
                    memory.write(rig.placed.inputs[name], rig.series[step - 1][name])
                output()
                rig.feed(step)
                first = rig.contents()
                output()
                assert rig.contents() == first, f"output saw one of {', '.join(others)}; ask for it by name"
                rig.engine.run(1)


def repeats_after_restore(subject: Subject) -> None:
    """Check that a run from a snapshot repeats to the bit, in the same engine and in a fresh one."""
    half = STEPS // 2
    for rig, fresh in zip(rigs(subject), rigs(subject), strict=True):
        with rig.engine:
            rig.run(range(half))
            snapshot = rig.engine.snapshot()
            first = rig.run(range(half, STEPS))
            _repeats(rig, snapshot, first, "the same engine")
        with fresh.engine:  # after the first engine is closed: only one engine at a time may write a file
            _repeats(fresh, snapshot, first, "a fresh engine")


def _repeats(rig: Rig, snapshot: Snapshot, first: list[tuple[Any, ...]], words: str) -> None:
    rig.engine.restore(snapshot)
    same = rig.run(range(STEPS - len(first), STEPS)) == first
    assert same, f"restored in {words} the run differs; keep in states what matters"
