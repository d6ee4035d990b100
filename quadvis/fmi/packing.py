"""Values of signals into the buffer of an exchange and out of it, as fast as Python can.

The text of each function is made for its signals: a loop over them would cost more than most FMUs do.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.fmi.exchange import FORMATS, Laid, Room
from quadvis.fmi.signals import FmuSignal

FIT = (struct.error, OverflowError)
LARGEST = 2**63


def laid_out(room: Room, version: int, signals: Sequence[FmuSignal]) -> Laid:
    """Lay signals out, those of one type side by side."""
    kinds = dict.fromkeys(signal.first.kind for signal in signals)
    sections, places = [], dict[int, int]()
    for kind in kinds:
        mine = [number for number, signal in enumerate(signals) if signal.first.kind == kind]
        references = [reference for number in mine for reference in signals[number].references]
        section = room.section(version, kind, references, sum(signals[number].count for number in mine))
        sections.append(section)
        place, size = section.offset, struct.calcsize(FORMATS[version][kind])
        for number in mine:
            places[number] = place
            place += signals[number].count * size
    return Laid(tuple(sections), [places[number] for number in range(len(signals))])


class _Writer:
    """Collects the lines of a function and what they name."""

    def __init__(
        self, version: int, signals: Sequence[FmuSignal], places: Sequence[int], buffer: Any
    ) -> None:
        self._version, self._signals, self._places, self._buffer = version, signals, places, buffer
        self.names: dict[str, Any] = {"buffer": buffer}
        self.lines: list[str] = []

    def runs(self) -> list[list[int]]:
        """Return the numbers of scalar signals in runs that lie side by side in one type."""
        found: list[list[int]] = []
        end, code = -1, ""
        order = sorted(range(len(self._signals)), key=self._places.__getitem__)
        for number in order:
            if self._signals[number].shape:
                continue
            mine = self.code(number)
            if mine != code or self._places[number] != end:
                found.append([])
            found[-1].append(number)
            code, end = mine, self._places[number] + struct.calcsize(mine)
        return found

    def code(self, number: int) -> str:
        """Return the format of a signal's values."""
        return FORMATS[self._version][self._signals[number].first.kind]

    def array(self, number: int) -> str:
        """Return the name of an array over a signal's bytes."""
        signal, name = self._signals[number], f"a{number}"
        self.names[name] = np.ndarray(signal.shape, self.code(number), self._buffer, self._places[number])
        return name

    def structure(self, run: Sequence[int], method: str) -> str:
        """Return the name of the method that packs or unpacks a run."""
        name = f"s{run[0]}"
        self.names[name] = getattr(struct.Struct(f"={len(run)}{self.code(run[0])}"), method)
        return name

    def factors(self, number: int) -> tuple[str, str]:
        """Return the names of factor and offset of a signal; "" for one that changes nothing."""
        conversion = self._signals[number].conversion
        factor, offset = f"f{number}", f"o{number}"
        self.names |= {factor: conversion.factor, offset: conversion.offset}
        return factor if conversion.factor != 1.0 else "", offset if conversion.offset else ""

    def made(self, head: str) -> Callable[..., Any]:
        """Return the function."""
        text = "\n".join([head, *(f"    {line}" for line in self.lines)])
        exec(compile(text, "<exchange of an FMU>", "exec"), self.names)
        made: Callable[..., Any] = self.names["exchange"]
        return made


def packer(
    version: int, signals: Sequence[FmuSignal], places: Sequence[int], buffer: Any
) -> Callable[..., None]:
    """Return the function that puts the values of signals (SI units) into a buffer.

    It raises one of ``FIT`` for a whole number that is too large for its type.
    """
    writer = _Writer(version, signals, places, buffer)

    def value(number: int) -> str:
        factor, offset = writer.factors(number)
        less = f"(p{number} - {offset})" if offset else f"p{number}"
        return f"{less} / {factor}" if factor else less

    for run in writer.runs():
        name, values = writer.structure(run, "pack_into"), ", ".join(map(value, run))
        writer.lines.append(f"{name}(buffer, {places[run[0]]}, {values})")
    for number, signal in enumerate(signals):
        if signal.shape:
            array = writer.array(number)
            whole = signal.scalar == "int64" and writer.code(number) not in "qQ"
            writer.names["fitted"] = _fitted
            writer.lines.append(f"{array}[...] = {f'fitted({array}, p{number})' if whole else value(number)}")
    writer.lines.append("return")
    return writer.made(f"def exchange({', '.join(f'p{number}' for number in range(len(signals)))}):")


def unpacker(
    version: int, signals: Sequence[FmuSignal], places: Sequence[int], buffer: Any
) -> Callable[[], Any]:
    """Return the function that gives the values of signals (SI units): one, or a tuple of several.

    An array may be one over the buffer, with its values until the next request: the engine copies it.
    """
    writer = _Writer(version, signals, places, buffer)
    results = dict[int, str]()
    for run in writer.runs():
        name = writer.structure(run, "unpack_from")
        writer.lines.append(f"{''.join(f'p{number}, ' for number in run)}= {name}(buffer, {places[run[0]]})")
        results |= {number: f"p{number}" for number in run}
    for number, signal in enumerate(signals):
        code = writer.code(number)
        if signal.shape:
            writer.names["wide"] = np.float64
            results[number] = writer.array(number) + (".astype(wide)" if code == "f" else "")
        if signal.scalar == "bool" and code != "?":
            results[number] = f"({results[number]} != 0)"
        elif code == "Q":
            writer.names["small"] = _small
            results[number] = f"small({results[number]})"
        elif signal.scalar == "float64":
            factor, offset = writer.factors(number)
            times, plus = f"{factor} * " if factor else "", f" + {offset}" if offset else ""
            results[number] = f"{times}{results[number]}{plus}"
    values = ", ".join(results[number] for number in range(len(signals)))
    writer.lines.append(f"return {values}" if signals else "return ()")
    return writer.made("def exchange():")


def _fitted(array: Any, values: Any) -> Any:
    """Return whole numbers that fit into an array; OverflowError if one does not."""
    limits = np.iinfo(array.dtype)
    if values.size and not (limits.min <= values.min() and values.max() <= limits.max):
        raise OverflowError(f"{values} does not fit into {array.dtype}")
    return values


def _small(value: Any) -> Any:
    """Return unsigned numbers of 64 bits if a wire can carry them."""
    if np.max(value) >= LARGEST:
        raise QuadvisError(f"the FMU gives {value}, beyond the whole numbers of a wire")
    return value if isinstance(value, int) else value.astype(np.int64)
