"""Signals on wires: their kinds and shapes, and frames."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import sentence

SCALARS = {"float64": float, "int64": int, "bool": bool}

Shape = tuple[int, ...]
Sizes = dict[str, Any]  # symbol -> int; "*" -> Shape
_SIZE = r"(?:[1-9]\d*|[a-z]\w*)"


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

    A wire carries one frame; a state may hold several, ``frame[4]``.
    """

    scalar: str
    shape: tuple[int | str, ...]

    @staticmethod
    @cache
    def parse(text: str) -> SignalType:
        """Read ``float64``, ``bool[3]``, ``int64[n]``, ``float64[*]`` (of any shape) or ``frame[4]``."""
        if several := re.fullmatch(r"frame(?:\[([1-9]\d*)\])?", text):
            return SignalType("frame", (int(several[1]),) if several[1] else ())
        match = re.fullmatch(rf"(\w+)(?:\[({_SIZE}(?:, *{_SIZE})*|\*)\])?", text)
        if match is None or match[1] not in SCALARS:
            remedy = "write float64, int64 or bool, with a shape such as [3], [4,2], [n] or [*]"
            raise TypeError(sentence(f"'{text}' is not a signal type", remedy))
        sizes = re.findall(_SIZE, match[2]) if match[2] and match[2] != "*" else (match[2] or "")
        return SignalType(match[1], tuple(int(size) if size.isdigit() else size for size in sizes))

    def resolve(self, sizes: Sizes) -> Shape:
        """Return the shape with every symbol replaced; if ``sizes`` lacks it, ``*`` is a scalar, others 1."""
        if self.shape == ("*",):
            return tuple(sizes.get("*", ()))
        return tuple(sizes.get(size, 1) if isinstance(size, str) else size for size in self.shape)

    def unify(self, shape: Shape, sizes: Sizes) -> bool:
        """Match a concrete shape, and add the symbols that it fixes to ``sizes``; False if it cannot fit."""
        if self.shape == ("*",):
            return bool(sizes.setdefault("*", shape) == shape)
        if len(shape) != len(self.shape):
            return False
        return all(
            (sizes.setdefault(size, length) if isinstance(size, str) else size) == length
            for size, length in zip(self.shape, shape, strict=True)
        )

    def __str__(self) -> str:
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")
