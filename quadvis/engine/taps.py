"""Taps: who takes rows of signals while a run goes on. The log and a scope are both taps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Tap(ABC):
    """Takes a block's outputs at the block's first and then at every ``every`` ticks of the block's own.

    ``block`` is the path of the block, ``topic`` that of its rows in the log of the run, "" if they do not go
    there. A row is taken when the outputs of the tick are there and before the updates. A restored run is
    tapped at the same ticks as the first one.
    """

    block: str
    every: int
    topic = ""

    @abstractmethod
    def take(self, tick: int, row: memoryview) -> None:
        """Take the bytes of the outputs, side by side as in memory; a tap that keeps them makes a copy."""

    def take_all(self, ticks: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        """Take the rows (N, slots) of N ticks (N,); nobody changes them from now on, nor may a tap."""
        for tick, row in zip(ticks.tolist(), rows, strict=True):
            self.take(tick, memoryview(row).cast("B"))


class MachineCall(NamedTuple):
    """The machine code of an observer, ``int32 f(int64 *places)``: its address, and the addresses it takes.

    Before these, ``places`` has the address of the present tick. ``owner`` owns what lies there.
    """

    address: int
    places: tuple[int, ...]
    owner: Any


class Observer(NamedTuple):
    """Something to do at the ticks of a task, with the memory as it is between outputs and updates.

    The compiled loop runs ``machine`` in the place of ``call``, if there is one.
    """

    task: str
    every: int
    call: Callable[[int], None]  # takes the tick
    machine: MachineCall | None = None
