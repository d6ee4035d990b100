"""Signals on wires: their kinds and shapes, and frames."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import sentence

SCALARS = {"float64": float, "int64": int, "bool": bool}

Shape = tuple[int, ...]
Sizes = dict[str, Any]  # symbol -> int; "*" -> Shape
ANY = ("*",)  # the shape of a declaration that any shape fits
PLUS = "+"
_SIZE = r"(?:[1-9]\d*|[a-z]\w*)"
_SUM = rf"{_SIZE}(?:\+{_SIZE})*"
_TYPE = re.compile(rf"(\w+)(?:\[({_SUM}(?:, *{_SUM})*|(?:{_SUM}, *)*\*)(\??)\])?", re.ASCII)


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture on its way through a diagram. Blocks share it by reference: never write into ``pixels``.

    ``pixels`` is uint8 (height, width, 3), blue-green-red; ``stamp`` is the middle of the exposure (s, run
    time); ``sequence`` counts frames from 1, and 0 means "no picture yet".
    """

    pixels: NDArray[np.uint8]
    stamp: float
    sequence: int

    @staticmethod
    def none() -> Frame:
        """Return the frame that says "no picture yet"."""
        return NO_FRAME


NO_FRAME = Frame(np.zeros((0, 0, 3), np.uint8), math.nan, 0)


@dataclass(frozen=True)
class SignalType:
    """The type of a signal, a scalar kind and a shape: ``float64[4,2]``, ``float64[n]``, ``frame``.

    A wire carries one frame; a state may hold several, ``frame[4]``, and several values of any shape,
    ``float64[16,*]``. Sizes may be added up, ``float64[m+n]``. With ``optional``, written ``[n?]``, a scalar
    fits, too: as an array of one element. Where any shape fits, ``[*?]``, a scalar stays one, and counts for
    every element.
    """

    scalar: str
    shape: tuple[int | str, ...]
    optional: bool = False

    @staticmethod
    @cache
    def parse(text: str) -> SignalType:
        """Read ``float64``, ``bool[3]``, ``int64[n]``, ``float64[*]`` (of any shape) or ``frame[4]``."""
        if several := re.fullmatch(r"frame(?:\[([1-9]\d*)\])?", text):
            return SignalType("frame", (int(several[1]),) if several[1] else ())
        match = _TYPE.fullmatch(text)
        if match is None or match[1] not in SCALARS or (match[3] and "," in match[2]):
            remedy = "write float64, int64 or bool, with a shape such as [3], [4,2], [n], [m+n] or [*]"
            raise TypeError(sentence(f"'{text}' is not a signal type", remedy))
        sizes = [size.strip() for size in match[2].split(",")] if match[2] else []
        shape = tuple(int(size) if size.isdigit() else size for size in sizes)
        return SignalType(match[1], shape, bool(match[3]))

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """The names of the sizes that are open: m and n of ``[3,m+n]``, and ``*``."""
        terms = (term for size in self.shape if isinstance(size, str) for term in size.split(PLUS))
        return tuple(term for term in terms if not term.isdigit())

    @cached_property
    def is_sum(self) -> bool:
        """Whether a size is a sum of sizes."""
        return any(PLUS in size for size in self.shape if isinstance(size, str))

    def parts(self, sizes: Sizes) -> tuple[int, ...]:
        """Return the lengths that a sum adds up, of a vector whose length is one; () for all else."""
        return _terms(str(self.shape[0]), sizes) if self.is_sum and len(self.shape) == 1 else ()

    def resolve(self, sizes: Sizes) -> Shape:
        """Return the shape with every symbol replaced; if ``sizes`` lacks it, ``*`` is a scalar, others 1."""
        found: list[int] = []
        for size in self.shape:
            if size == "*":
                found += sizes.get("*", ())
            else:
                found.append(sum(_terms(size, sizes)) if isinstance(size, str) else size)
        return tuple(found)

    def unify(self, shape: Shape, sizes: Sizes) -> bool:
        """Match a concrete shape, and add the symbols that it fixes to ``sizes``; False if it cannot fit."""
        if self.shape == ANY:
            return bool((self.optional and not shape) or sizes.setdefault("*", shape) == shape)
        if self.optional and not shape:
            shape = (1,)
        if len(shape) != len(self.shape):
            return False
        return all(
            _length(size, length, sizes) == length for size, length in zip(self.shape, shape, strict=True)
        )

    def __str__(self) -> str:
        sizes = ",".join(map(str, self.shape)) + "?" * self.optional
        return self.scalar + (f"[{sizes}]" if self.shape else "")


def _terms(size: str, sizes: Sizes) -> tuple[int, ...]:
    """Return the lengths that a size adds up; an unknown one is 1."""
    return tuple(int(term) if term.isdigit() else sizes.get(term, 1) for term in size.split(PLUS))


def _length(size: int | str, found: int, sizes: Sizes) -> int:
    """Return the length of an axis; one whose name has no length yet has the one that was found."""
    if isinstance(size, int):
        return size
    if PLUS in size:
        return sum(_terms(size, sizes))
    length: int = sizes.setdefault(size, found)
    return length
