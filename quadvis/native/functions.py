"""Plain functions of a library that run as machine code once it is there, with the same bits.

A function is declared with the kinds of what it takes and gives. It is called as ever, and interpreted until
`load` or `prepare` was asked for its machine code, which lies in the same cache as that of block types.
"""

from __future__ import annotations

import ctypes
import re
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

LOOPS = "__loops__"  # an attribute of a function: the function that machine code takes in its place
KIND = re.compile(r"(uint8|int64|float64)(?:\[([\w,]+)\])?")

Function = TypeVar("Function", bound=Callable[..., Any])
PICTURE = "uint8"
KNOWN = 64  # sizes of arguments for which memory is kept
FAILED = object()
Dimensions = tuple[int | str, ...]


@dataclass(frozen=True)
class ArrayKind:
    """An array: its scalar, and its shape by numbers and letters, which stand for the same in all kinds."""

    scalar: str
    shape: Dimensions

    def __str__(self) -> str:
        return f"{self.scalar}[{','.join(map(str, self.shape))}]" if self.shape else self.scalar

    @staticmethod
    def of(text: str) -> ArrayKind:
        """Read a kind, such as ``float64[n,3]``; ValueError if it is none."""
        match = KIND.fullmatch(text)
        if match is None:
            raise ValueError(f"'{text}' is no kind; write one such as 'float64[n,3]'")
        parts = match[2].split(",") if match[2] else []
        return ArrayKind(match[1], tuple(int(part) if part.isdigit() else part for part in parts))


class NativeFunction:
    """A function of arrays and numbers, which a call takes in its declared kinds, and its machine code."""

    def __init__(self, function: types.FunctionType, takes: Sequence[str], gives: Sequence[str]) -> None:
        self.function = function
        self.takes, self.gives = tuple(map(ArrayKind.of, takes)), tuple(map(ArrayKind.of, gives))
        self.letters = tuple(
            dict.fromkeys(part for kind in self.takes for part in kind.shape if isinstance(part, str))
        )
        unknown = {part for kind in self.gives for part in kind.shape if isinstance(part, str)}
        if not unknown <= set(self.letters):
            raise ValueError(f"{function.__qualname__} gives sizes that it does not take")
        self._address: int | None = None
        self._calls: dict[tuple[int, ...], _Call] = {}  # by what the letters stand for
        self.__doc__, self.__name__, self.__wrapped__ = function.__doc__, function.__name__, function

    @property
    def text(self) -> str:
        """All that decides over the machine code beside the software and the processor."""
        from quadvis.native.source import fingerprint

        return repr((self.__name__, fingerprint(self.function), self.takes, self.gives))

    def bind(self, address: int | None) -> None:
        """Call machine code at an address from now on, or the interpreter."""
        self._address = address
        self._calls.clear()

    @property
    def is_native(self) -> bool:
        """Whether calls run machine code."""
        return self._address is not None

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; what machine code refuses, the interpreter repeats."""
        if self._address is None:
            return self.function(*arguments)
        sizes = self._sizes(arguments)
        call = self._calls.get(sizes)
        if call is None:
            if len(self._calls) >= KNOWN:
                self._calls.clear()
            call = self._calls[sizes] = _Call(self, self._address, sizes)
        found = call.run(arguments)
        return self.function(*arguments) if found is FAILED else found

    def _sizes(self, arguments: Sequence[Any]) -> tuple[int, ...]:
        """Return what the letters stand for; TypeError if the arguments do not have the declared shapes."""
        sizes: dict[int | str, int] = {}
        for kind, value in zip(self.takes, arguments, strict=True):
            shape = np.shape(value) if kind.shape else ()
            if len(shape) != len(kind.shape) or any(
                (sizes.setdefault(part, size) if isinstance(part, str) else part) != size
                for part, size in zip(kind.shape, shape, strict=True)
            ):
                raise TypeError(f"{self.__name__} takes {kind}, not an array of shape {shape}")
        return tuple(sizes[letter] for letter in self.letters)


class _Call:
    """A function's machine code with memory for arguments of one size, and for the results.

    Arguments of ``uint8``, which are pictures, are read where they are.
    """

    def __init__(self, function: NativeFunction, address: int, sizes: tuple[int, ...]) -> None:
        known = dict(zip(function.letters, sizes, strict=True))
        self._call = ctypes.PYFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)(address)

        def room(kind: ArrayKind) -> NDArray[Any]:
            shape = [part if isinstance(part, int) else known[part] for part in kind.shape]
            return np.empty(shape, kind.scalar)

        self._given = [None if kind.scalar == PICTURE else room(kind) for kind in function.takes]
        self._found = [room(kind) for kind in function.gives]
        letters = np.array(sizes, np.int64)
        self._memory = letters, *self._given, *self._found
        self._places = np.array([0 if each is None else each.ctypes.data for each in self._memory], np.int64)
        self._start = self._places.ctypes.data

    def run(self, arguments: Sequence[Any]) -> Any:
        """Return the results, FAILED if there are none."""
        kept = []
        for index, (array, value) in enumerate(zip(self._given, arguments, strict=True)):
            if array is None:
                picture = np.ascontiguousarray(value, np.uint8)
                kept.append(picture)
                self._places[index + 1] = picture.ctypes.data
            else:
                array[...] = value
        if self._call(self._start):
            return FAILED
        results = [each.copy() if each.ndim else each.item() for each in self._found]
        return results[0] if len(results) == 1 else tuple(results)


def compiled_as(loops: Callable[..., Any]) -> Callable[[Function], Function]:
    """Declare that machine code takes another function in place of this one: loops, with the same bits.

    Arrays are fast in Python and slow to compile; loops are the other way round.
    """

    def declared(function: Function) -> Function:
        vars(function)[LOOPS] = loops
        return function

    return declared


def native(takes: Sequence[str], gives: Sequence[str]) -> Callable[[Callable[..., Any]], NativeFunction]:
    """Declare that a plain function may run as machine code; it calls plain functions and numpy's only."""

    def declared(function: Callable[..., Any]) -> NativeFunction:
        assert isinstance(function, types.FunctionType)
        return NativeFunction(function, takes, gives)

    return declared


def load(functions: Sequence[NativeFunction]) -> bool:
    """Run functions, which are compiled together, as machine code if that is kept; return whether it is."""
    from quadvis.native.library import library

    return all(function.is_native for function in functions) or library().load_functions(functions)


def prepare(functions: Sequence[NativeFunction]) -> None:
    """Run functions, which are compiled together, as machine code; compile it if it is not kept."""
    from quadvis.native.library import library

    if not load(functions):
        library().compile_functions(functions)
