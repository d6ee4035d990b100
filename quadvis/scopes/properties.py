"""The properties of a scope: their names, as in xPC Target, and how a value is read.

``property_name`` is the one place that accepts other spellings of a name: ``num_samples`` is ``NumSamples``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from quadvis.errors import QuadvisError, closest, quoted, sentence, suggestion

HOST, TARGET, FILE = TYPES = ("host", "target", "file")
FREERUN, SOFTWARE, SIGNAL, SCOPE = TRIGGER_MODES = ("FreeRun", "Software", "Signal", "Scope")
EITHER, RISING, FALLING = SLOPES = ("Either", "Rising", "Falling")
NUMERICAL, REDRAW, SLIDING, ROLLING = MODES = ("numerical", "redraw", "sliding", "rolling")
LAZY, COMMIT = WRITE_MODES = ("Lazy", "Commit")
AT_END = -1  # the TriggerSample that means: on the sample after the triggering scope has finished
MOST = 1_000_000_000  # of a whole number without a limit of its own
OLDER = {"interleave": "Decimation", "displaymode": "Mode"}  # other names that xPC Target has

Reader = Callable[[str, Any], Any]  # takes the name and a value; returns the value as it is kept


def _word(*words: str) -> Reader:
    def read(name: str, value: Any) -> str:
        same = {word.lower(): word for word in words}
        found = same.get(str(value).lower())
        if found is None:
            raise QuadvisError(sentence(f"{name} is {quoted(value)}", suggestion(str(value), words)))
        return found

    return read


def _whole(least: int, most: int = MOST) -> Reader:
    def read(name: str, value: Any) -> int:
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not whole and isinstance(value, float) and value.is_integer():
            value, whole = int(value), True
        if not whole or not least <= value <= most:
            raise QuadvisError(f"{name} is {quoted(value)}; give a whole number from {least} to {most}")
        return int(value)

    return read


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise QuadvisError(f"{name} is {quoted(value)}; give a finite number, in the unit of the signal")
    return float(value)


def _switch(name: str, value: Any) -> bool:
    found = {"true": True, "on": True, "1": True, "false": False, "off": False, "0": False}
    if str(value).lower() not in found:
        raise QuadvisError(f"{name} is {quoted(value)}; give true or false")
    return found[str(value).lower()]


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise QuadvisError(f"{name} is {quoted(value)}; give a text")
    return value


def _signals(name: str, value: Any) -> tuple[str, ...]:
    given: tuple[Any, ...] = ()
    if isinstance(value, Iterable):
        given = (value,) if isinstance(value, str) else tuple(value)
    if not isinstance(value, Iterable) or not all(isinstance(each, str) for each in given):
        raise QuadvisError(f"{name} are {quoted(value)}; give a list of names such as 'craft.position[2]'")
    for number, each in enumerate(given):
        if each in given[:number]:
            raise QuadvisError(f"the signal {quoted(each)} is there twice; name each signal once")
    return given


def _limits(name: str, value: Any) -> tuple[float, float] | None:
    if value is None or value == "auto":
        return None
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise QuadvisError(f"{name} is {quoted(value)}; give 'auto', or the least and the greatest value")
    least, greatest = (_number(name, each) for each in value)
    if not least < greatest:
        raise QuadvisError(f"{name} goes from {least:g} to {greatest:g}; give the least value first")
    return least, greatest


READERS: dict[str, Reader] = {
    "Type": _word(*TYPES),
    "Signals": _signals,
    "NumSamples": _whole(1),
    "NumPrePostSamples": _whole(-MOST),
    "Decimation": _whole(1),
    "TriggerMode": _word(*TRIGGER_MODES),
    "TriggerSignal": _text,
    "TriggerLevel": _number,
    "TriggerSlope": _word(*SLOPES),
    "TriggerScope": _whole(0),
    "TriggerSample": _whole(AT_END),
    "AutoRestart": _switch,
    "Mode": _word(*MODES),
    "YLimit": _limits,
    "Grid": _switch,
    "Filename": _text,
    "WriteMode": _word(*WRITE_MODES),
    "MaxFileSize": _whole(1, 1 << 50),
}
OF_TYPE = {
    **dict.fromkeys(("Mode", "YLimit", "Grid"), TARGET),
    **dict.fromkeys(("Filename", "WriteMode", "MaxFileSize"), FILE),
}  # properties that only one type of scope has


def property_name(word: str) -> str:
    """Return the name of a property, which may be written in any case and with underscores."""
    plain = {name.lower(): name for name in READERS} | OLDER
    found = plain.get(str(word).replace("_", "").lower())
    if found is None:
        near = closest(str(word).replace("_", ""), READERS)
        remedy = f"did you mean {quoted(near)}?" if near else f"it has {', '.join(READERS)}"
        raise QuadvisError(f"a scope has no property {quoted(word)}; {remedy}")
    return found


def read_property(name: str, value: Any) -> Any:
    """Return the value of a property as it is kept; QuadvisError if it cannot have this value."""
    return READERS[name](name, value)
