"""A run that is taken back to a snapshot, for tests of what has a state."""

from __future__ import annotations

from quadvis.engine.engine import Engine


def check_repeats(engine: Engine, before: int, after: int) -> None:
    """Run some ticks, then further ones, and these again from a snapshot: memory is the same to the bit."""
    with engine:
        engine.run(before)
        snapshot = engine.snapshot()
        engine.run(after)
        once = engine.memory.content()
        engine.restore(snapshot)
        engine.run(after)
        assert engine.memory.content() == once
