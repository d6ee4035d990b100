"""Statistics of samples that come piece by piece, equal to the bit to those of all samples together.

Samples are (N, elements). RMS, mean and the extremes are over all elements of all samples together. ``max``
is the largest magnitude, ``count`` the number of samples with any element other than 0, ``final`` the last
sample, element by element. A NaN among the samples makes every statistic but ``final`` NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]
Value = float | tuple[float, ...]  # a tuple has one number for each element

COUNT, FINAL = "count", "final"  # COUNT has no unit; FINAL has a value for each element


class Statistic(Protocol):
    """Takes samples as they come, never an empty piece. Before the first samples its value is NaN."""

    def add(self, samples: Samples) -> None:
        """Take more samples."""

    @property
    def value(self) -> Value:
        """The statistic of the samples so far."""


class RunningSum:
    """The sum of ``size`` numbers, equal to the bit to numpy's sum of one array with all of them.

    To lose few digits, numpy adds the sums of two halves, each of which is again a sum of two halves. When a
    half of at most LEAF numbers is complete, numpy adds it, so only such a half is kept. If fewer numbers
    come than ``size``, their sum is right too, but rounded in another order.
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
        """Return the size of numpy's first half; numpy adds eight numbers at a time."""
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
    """The mean, or its square root, of a function of the samples; ``size`` is the number of elements."""

    def __init__(self, size: int, of: Callable[[Samples], Samples], root: bool = False) -> None:
        self._sum, self._of, self._root, self._count = RunningSum(size), of, root, 0

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
    """The largest or smallest value of a function of the samples."""

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
    """The number of samples that are not 0."""

    def __init__(self) -> None:
        self._found, self._missing, self._any = 0, False, False

    def add(self, samples: Samples) -> None:
        """Take more samples."""
        self._found += int(np.count_nonzero(samples.any(axis=1)))
        self._missing = self._missing or bool(np.isnan(samples).any())
        self._any = True

    @property
    def value(self) -> float:
        """The number of such samples so far."""
        return float(self._found) if self._any and not self._missing else math.nan


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


# Constructors by name; each takes the number of samples and the number of elements.
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
