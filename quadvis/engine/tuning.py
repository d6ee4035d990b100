"""Tuning: parameters that change between two ticks of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from quadvis.block import Block, ParameterError
from quadvis.engine.memory import Memory
from quadvis.engine.program import Program
from quadvis.errors import sentence, suggestion


class Change(NamedTuple):
    """A parameter that took a new value before a tick: a value as a diagram gives it, in SI units."""

    tick: int
    path: str
    name: str
    value: Any


class Tuning:
    """Checks new values of tunable parameters, and writes them into memory between two ticks.

    Values that are set together take effect at one tick. ``changes`` is the history of a run; ``noted``, if
    it is set, is called with each change before the tick runs.
    """

    def __init__(self, program: Program, blocks: Sequence[Block], memory: Memory) -> None:
        self._memory = memory
        self._blocks = blocks
        self._tunables = {(tunable.path, tunable.name): tunable for tunable in program.tunables}
        self._waiting: dict[tuple[str, str], Any] = {}
        self.changes: list[Change] = []
        self.noted: Callable[[Change], None] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All tunable parameters, such as "control/roll.bandwidth"."""
        return tuple(f"{path}.{name}" for path, name in self._tunables)

    def set(self, path: str, name: str, value: Any) -> None:
        """Let a parameter have a value (SI units) from the next tick on.

        ParameterError if it is not tunable, if the value does not fit, or if the block refuses it together
        with its other parameters; then nothing changes.
        """
        key = (path, name)
        if key not in self._tunables:
            raise ParameterError(name, sentence(*self._refusal(path, name)))
        block = self._blocks[self._tunables[key].block]
        param = block.interface.params[name]
        accepted = param.accept(value)
        given = {each: self._now(path, each, block) for each in block.interface.params}
        type(block)(period=block.period, **given | {name: value})
        self._waiting[key] = accepted

    def _now(self, path: str, name: str, block: Block) -> Any:
        """Return a parameter as a diagram would give it, with the changes that wait."""
        param = block.interface.params[name]
        value = self._waiting.get((path, name))
        if value is None:
            tunable = self._tunables.get((path, name))
            value = getattr(block, name) if tunable is None else self._memory.read(tunable.slot)
        return param.choices[value] if param.choices else value

    def _refusal(self, path: str, name: str) -> tuple[str, str]:
        wanted = f"{path}.{name}"
        mine = [each for owner, each in self._tunables if owner == path]
        if any(block for block in self._blocks if name in block.interface.params) and mine:
            return f"'{wanted}' cannot be tuned", f"block '{path}' can be tuned in {', '.join(mine)}"
        return f"'{wanted}' is no parameter that can be tuned", suggestion(wanted, self.names)

    def apply(self, tick: int) -> None:
        """Write the waiting values into memory, before a tick."""
        if self._waiting:
            for (path, name), value in self._waiting.items():
                self._memory.write(self._tunables[path, name].slot, value)
                param = self._blocks[self._tunables[path, name].block].interface.params[name]
                self.changes.append(
                    Change(tick, path, name, param.choices[value] if param.choices else value)
                )
                if self.noted is not None:
                    self.noted(self.changes[-1])
            self._waiting.clear()
