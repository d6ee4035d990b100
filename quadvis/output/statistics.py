"""Statistics of samples that come piece by piece, to the bit those of all samples at once.

Samples are (N, elements). RMS, mean and the extremes are over all elements of all samples together, ``max``
is the largest magnitude; ``count`` is that of samples of which any element is not 0; ``final`` is the last
sample, element by element. A NaN among the samples makes all but ``final`` NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]
Value = float | tuple[float, ...]  # of several elements, one for each

COUNT, FINAL = "count", "final"  # the one without a unit, and the one that has a value for each element


class Statistic(Protocol):
    """Takes samples as they come; none of them may be empty. Before the first its value is NaN."""

    def add(self, samples: Samples) -> None:
        """Take more samples."""

    @property
    def value(self) -> Value:
        """What the samples so far give."""


class Sum:
    """The sum of ``size`` numbers, to the bit the one that numpy makes of them in one array.

    To lose few digits numpy adds the sums of two halves, each a sum of two halves itself. Halves of at most
    LEAF numbers are left to numpy when they are complete, so that no more than those are kept. Fewer numbers
    than were promised give their sum too, with the rounding of another order.
    """

    LEAF = 1 << 13

    def __init__(self, size: int) -> None:
        self.size = size
        self._leaves = self._sizes(size)
        self._wanted = next(self._leaves)
        self._waiting: list[Samples] = []
        self._count = 0
        self._sums: list[np.float64] = []

    def add(self, numbers: Samples) -> None:
        """Take more numbers, (N,)."""
        while self._count + len(numbers) >= self._wanted > 0:
            rest = self._wanted - self._count
            self._sums.append(np.add.reduce(np.concatenate((*self._waiting, numbers[:rest]))))
            numbers, self._waiting, self._count = numbers[rest:], [], 0
            self._wanted = next(self._leaves, 0)
        if len(numbers):
            self._waiting.append(numbers.copy())
            self._count += len(numbers)

    @property
    def value(self) -> np.float64:
        """The sum."""
        left = [np.add.reduce(np.concatenate(self._waiting))] if self._waiting else []
        return self._joined(self.size, iter([*self._sums, *left]))

    @staticmethod
    def _half(size: int) -> int:
        """Return how many numbers numpy's first half has: it adds eight at a time."""
        return size // 2 - size // 2 % 8

    def _sizes(self, size: int) -> Iterator[int]:
        if size <= self.LEAF:
            yield size
        else:
            yield from self._sizes(self._half(size))
            yield from self._sizes(size - self._half(size))

    def _joined(self, size: int, sums: Iterator[np.float64]) -> np.float64:
        if size <= self.LEAF:
            return next(sums, np.float64(0.0))
        return self._joined(self._half(size), sums) + self._joined(size - self._half(size), sums)


class Mean:
    """The mean, or its root, of what a function makes of the samples; ``size`` is how many elements come."""

    def __init__(self, size: int, of: Callable[[Samples], Samples], root: bool = False) -> None:
        self._sum, self._of, self._root, self._count = Sum(size), of, root, 0

    def add(self, samples: Samples) -> None:
        """Take more samples."""
        self._sum.add(self._of(samples).ravel())
        self._count += samples.size

    @property
    def value(self) -> float:
        """The mean of the samples so far."""
        if not self._count:
            return math.nan
        mean = self._sum.value / self._count
        return float(np.sqrt(mean) if self._root else mean)


class Extreme:
    """The largest or smallest of what a function makes of the samples."""

    def __init__(self, choose: np.ufunc, of: Callable[[Samples], Samples]) -> None:
        self._choose, self._of = choose, of
        self._found: np.float64 | None = None

    def add(self, samples: Samples) -> None:
        """Take more samples."""
        found = self._choose.reduce(self._of(samples), axis=None)
        self._found = found if self._found is None else self._choose(self._found, found)

    @property
    def value(self) -> float:
        """The extreme of the samples so far."""
        return math.nan if self._found is None else float(self._found)


class Count:
    """How many samples are not 0."""

    def __init__(self) -> None:
        self._found, self._missing, self._some = 0, False, False

    def add(self, samples: Samples) -> None:
        """Take more samples."""
        self._found += int(np.count_nonzero(samples.any(axis=1)))
        self._missing = self._missing or bool(np.isnan(samples).any())
        self._some = True

    @property
    def value(self) -> float:
        """How many there were so far."""
        return float(self._found) if self._some and not self._missing else math.nan


class Final:
    """The last sample."""

    def __init__(self, elements: int) -> None:
        self._last = np.full(elements, math.nan)

    def add(self, samples: Samples) -> None:
        """Take more samples."""
        self._last = samples[-1].copy()

    @property
    def value(self) -> Value:
        """The last sample so far, a tuple if it has several elements."""
        values = tuple(self._last.tolist())
        return values[0] if len(values) == 1 else values


def _same(samples: Samples) -> Samples:
    return samples


# By name; made for so many samples of so many elements.
STATISTICS: Mapping[str, Callable[[int, int], Statistic]] = {
    "rms": lambda count, elements: Mean(count * elements, np.square, root=True),
    "max": lambda count, elements: Extreme(np.maximum, np.abs),
    "mean": lambda count, elements: Mean(count * elements, _same),
    "lowest": lambda count, elements: Extreme(np.minimum, _same),
    "highest": lambda count, elements: Extreme(np.maximum, _same),
    FINAL: lambda count, elements: Final(elements),
    COUNT: lambda count, elements: Count(),
}


def finite(value: Value) -> Any:
    """Return a value for JSON: None in place of an infinite number or NaN."""
    if isinstance(value, tuple):
        return [finite(each) for each in value]
    return value if math.isfinite(value) else None
