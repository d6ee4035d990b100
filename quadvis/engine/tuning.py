"""Tuning: parameters that change between two ticks of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from quadvis.block import Block, ParameterError
from quadvis.engine.memory import Memory
from quadvis.engine.program import Program, Tunable
from quadvis.errors import sentence, suggestion

Key = tuple[str, str]  # the path of a block, and the name of a parameter of it


class NewValue(NamedTuple):
    """A value that a parameter is to take: as a diagram gives it, in SI units."""

    path: str
    name: str
    value: Any


class Change(NamedTuple):
    """A parameter that took a new value before a tick: a value as a diagram gives it, in SI units."""

    tick: int
    path: str
    name: str
    value: Any


class Acceptance:
    """Checks groups of new values against the declarations of blocks, and against the values in force.

    ``blocks`` are those with ``tunables``, by path. ``now`` returns the value in force of a parameter that
    can be tuned, as the block's methods see it.
    """

    def __init__(
        self, tunables: Iterable[Tunable], blocks: Mapping[str, Block], now: Callable[[Tunable], Any]
    ) -> None:
        self._blocks, self._now = blocks, now
        self.tunables = {(each.path, each.name): each for each in tunables}

    @property
    def names(self) -> tuple[str, ...]:
        """All tunable parameters, such as "control/roll.bandwidth"."""
        return tuple(f"{path}.{name}" for path, name in self.tunables)

    def accept(self, group: Sequence[NewValue]) -> dict[Key, Any]:
        """Return the values of a group as the methods will see them; of one parameter the last one counts.

        ParameterError if a parameter is not tunable, if a value does not fit, or if a block refuses its
        values together with its other parameters.
        """
        accepted: dict[Key, Any] = {}
        given: dict[str, dict[str, Any]] = {}
        for path, name, value in group:
            accepted[path, name] = self._accepted(path, name, value)
            given.setdefault(path, {})[name] = value
        for path, values in given.items():
            block = self._blocks[path]
            present = {name: self._given(path, name, block) for name in block.interface.params}
            type(block)(period=block.period, **present | values)
        return accepted

    def as_given(self, path: str, name: str, accepted: Any) -> Any:
        """Return a value as a diagram gives it."""
        choices = self._blocks[path].interface.params[name].choices
        return choices[accepted] if choices else accepted

    def _accepted(self, path: str, name: str, value: Any) -> Any:
        tunable = self.tunables.get((path, name))
        if tunable is None:
            raise ParameterError(name, sentence(*self._refusal(path, name)))
        accepted = self._blocks[path].interface.params[name].accept(value)
        shape, wanted = np.shape(accepted), tunable.slot.shape
        if shape not in ((), wanted):
            raise ParameterError(name, f"{name} has {_size(wanted)} in this run, got {_size(shape)}")
        return accepted

    def _given(self, path: str, name: str, block: Block) -> Any:
        """Return a parameter as a diagram would give it now."""
        tunable = self.tunables.get((path, name))
        return self.as_given(path, name, getattr(block, name) if tunable is None else self._now(tunable))

    def _refusal(self, path: str, name: str) -> tuple[str, str]:
        wanted = f"{path}.{name}"
        mine = [each for owner, each in self.tunables if owner == path]
        if any(name in block.interface.params for block in self._blocks.values()) and mine:
            return f"'{wanted}' cannot be tuned", f"block '{path}' can be tuned in {', '.join(mine)}"
        return f"'{wanted}' is no parameter that can be tuned", suggestion(wanted, self.names)


def _size(shape: Sequence[int]) -> str:
    """Return a shape in words."""
    if tuple(shape) == (1,):
        return "a list of one value"
    return f"{' x '.join(map(str, shape))} values" if shape else "one value"


class Tuning:
    """Takes new values of tunable parameters, and writes them into memory between two ticks.

    Values that are set together take effect at one tick. ``changes`` is the history of a run; ``noted``, if
    it is set, is called with each change before the tick runs.
    """

    def __init__(self, program: Program, blocks: Mapping[str, Block], memory: Memory) -> None:
        self._memory = memory
        self._waiting: dict[Key, Any] = {}
        self._acceptance = Acceptance(program.tunables, blocks, self._now)
        self.changes: list[Change] = []
        self.noted: Callable[[Change], None] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All tunable parameters, such as "control/roll.bandwidth"."""
        return self._acceptance.names

    def set(self, path: str, name: str, value: Any) -> None:
        """Let a parameter have a value (SI units) from the next tick on; see `set_all`."""
        self.set_all([NewValue(path, name, value)])

    def set_all(self, group: Sequence[NewValue]) -> None:
        """Let parameters have new values from the next tick on; their blocks check them together.

        ParameterError if one of them is refused; then nothing changes. See `Acceptance.accept`.
        """
        self._waiting |= self._acceptance.accept(group)

    def _now(self, tunable: Tunable) -> Any:
        """Return the value in force, with the changes that wait."""
        waiting = self._waiting.get((tunable.path, tunable.name))
        return self._memory.read(tunable.slot) if waiting is None else waiting

    def apply(self, tick: int) -> None:
        """Write the waiting values into memory, before a tick."""
        if self._waiting:
            for (path, name), value in self._waiting.items():
                self._memory.write(self._acceptance.tunables[path, name].slot, value)
                self.changes.append(Change(tick, path, name, self._acceptance.as_given(path, name, value)))
                if self.noted is not None:
                    self.noted(self.changes[-1])
            self._waiting.clear()
