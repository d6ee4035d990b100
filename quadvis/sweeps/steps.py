"""The values of a range, computed when they are asked for: a million seeds need no memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import overload


@dataclass(frozen=True)
class Steps(Sequence[str]):
    """Values as texts, ``length`` of them, from ``first`` on, ``step`` apart, each with the unit."""

    first: Decimal
    step: Decimal
    length: int
    unit: str = ""

    def __len__(self) -> int:
        return self.length

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[str, ...]: ...
    def __getitem__(self, index: int | slice) -> str | tuple[str, ...]:
        if isinstance(index, slice):
            return tuple(self[each] for each in range(self.length)[index])
        number = _plain(self.number(index))
        return f"{number} {self.unit}" if self.unit else number

    def number(self, index: int) -> Decimal:
        """Return a value without its unit; IndexError beyond the last."""
        return self.first + range(self.length)[index] * self.step

    @property
    def are_whole(self) -> bool:
        """True if all values are whole numbers without a unit."""
        return not self.unit and self.first == int(self.first) and self.step == int(self.step)


@dataclass(frozen=True)
class StepNumbers(Sequence[float]):
    """The same values as numbers, in their unit."""

    steps: Steps

    def __len__(self) -> int:
        return len(self.steps)

    @overload
    def __getitem__(self, index: int) -> float: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[float, ...]: ...
    def __getitem__(self, index: int | slice) -> float | tuple[float, ...]:
        if isinstance(index, slice):
            return tuple(self[each] for each in range(len(self))[index])
        return float(self.steps.number(index))


def _plain(value: Decimal) -> str:
    """Return a decimal number without an exponent and without trailing zeros."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
