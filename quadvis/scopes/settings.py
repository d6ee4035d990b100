"""The settings of a scope, and which of them may change while it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Self

from quadvis.errors import QuadvisError, counted, quoted
from quadvis.scopes.properties import (
    EITHER,
    FREERUN,
    HOST,
    LAZY,
    OF_TYPE,
    REDRAW,
    SCOPE,
    SIGNAL,
    TARGET,
    property_name,
    read_property,
)

MOST_VALUES = 2_000_000  # of a package, and of the samples kept before a trigger: 16 MB each
LIVE = ("TriggerLevel", "TriggerSlope", "AutoRestart", "Mode", "YLimit", "Grid")  # may change at any time


@dataclass(frozen=True)
class ScopeSettings:
    """The properties of a scope, by their names in xPC Target. Values are checked; QuadvisError says which.

    ``Type``: "host", "target" or "file". ``Signals``: names such as "craft.position[2]"; a vector is several
    traces. ``NumSamples`` of each trace make a package; every ``Decimation``-th row is a sample.
    ``NumPrePostSamples`` counts samples: below zero, so many before the trigger are in the package; above,
    so many after it are not. It has no effect in FreeRun.

    ``TriggerMode``: "FreeRun", "Software", "Signal" (``TriggerSignal`` crosses ``TriggerLevel``, in the unit
    of this signal, with ``TriggerSlope`` "Either", "Rising" or "Falling") or "Scope" (sample
    ``TriggerSample`` of the scope ``TriggerScope``, counted from its trigger; -1: the sample after its last).

    ``AutoRestart``: a host or file scope begins again after a package; target scopes always do.

    Target scopes have ``Mode`` ("numerical", "redraw", "rolling"; "sliding" is shown as "rolling"),
    ``YLimit`` (least and greatest value, or "auto") and ``Grid``. File scopes have ``Filename`` ("" is
    SC1DATA.mcap for scope 1; % stand for a number), ``WriteMode`` ("Lazy", "Commit") and ``MaxFileSize``
    (bytes).
    """

    Type: str = HOST
    Signals: tuple[str, ...] = ()
    NumSamples: int = 250
    NumPrePostSamples: int = 0
    Decimation: int = 1
    TriggerMode: str = FREERUN
    TriggerSignal: str = ""
    TriggerLevel: float = 0.0
    TriggerSlope: str = EITHER
    TriggerScope: int = 0
    TriggerSample: int = 0
    AutoRestart: bool = False
    Mode: str = REDRAW
    YLimit: tuple[float, float] | None = None
    Grid: bool = True
    Filename: str = ""
    WriteMode: str = LAZY
    MaxFileSize: int = 1 << 29

    def __post_init__(self) -> None:
        for field in fields(self):
            value = read_property(field.name, getattr(self, field.name))
            object.__setattr__(self, field.name, value)  # the one form of a value, such as "FreeRun"
            owner = OF_TYPE.get(field.name, self.Type)
            if owner != self.Type and value != field.default:
                raise QuadvisError(f"{field.name} is for {owner} scopes, and this is a {self.Type} scope")

    @classmethod
    def read(cls, given: Mapping[str, Any]) -> Self:
        """Return settings from names and values; names may be written as ``num_samples``."""
        return cls(**_named(given))

    def changed(self, given: Mapping[str, Any], running: bool, who: str = "the scope") -> Self:
        """Return these settings with changes; QuadvisError if they cannot be made, or not while it runs."""
        changes = _named(given)
        made = replace(self, **changes)
        for name in changes:
            if getattr(made, name) == getattr(self, name):
                continue
            if name == "Type":
                raise QuadvisError(f"{who} stays a {self.Type} scope; add another one of the other type")
            if running and name not in LIVE:
                raise QuadvisError(f"{who} is running; stop it before you change {name}")
        return made

    @property
    def before(self) -> int:
        """The number of samples that are kept before a trigger."""
        return max(0, -self.shift)

    @property
    def shift(self) -> int:
        """The number of samples from the trigger to the first one of a package."""
        return 0 if self.TriggerMode == FREERUN else self.NumPrePostSamples

    @property
    def restarts(self) -> bool:
        """Whether it begins anew by itself after a package."""
        free = self.Type == HOST and self.TriggerMode == FREERUN
        return self.Type == TARGET or self.AutoRestart or free

    def check_start(self, who: str, traces: int) -> None:
        """Raise QuadvisError if a scope with so many traces cannot run with these settings."""
        if not traces:
            raise QuadvisError(f"{who} has no signals; give it Signals")
        if self.TriggerMode == SIGNAL and not self.TriggerSignal:
            raise QuadvisError(f"{who} waits for a signal; name it as its TriggerSignal")
        if self.TriggerMode == SCOPE and not self.TriggerScope:
            raise QuadvisError(f"{who} waits for another scope; give its number as TriggerScope")
        if self.before > self.NumSamples:
            problem = f"NumPrePostSamples of {who} is {self.NumPrePostSamples}"
            raise QuadvisError(f"{problem}; a package has only {counted(self.NumSamples, 'sample')}")
        most = MOST_VALUES // traces
        if self.NumSamples > most or self.before * self.Decimation > most:
            what = "NumSamples" if self.NumSamples > most else "NumPrePostSamples times Decimation"
            raise QuadvisError(f"{what} of {who} is above {most}, the most for {counted(traces, 'trace')}")


def _named(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by the names of their properties; QuadvisError if two name the same one."""
    found: dict[str, Any] = {}
    for word, value in given.items():
        name = property_name(word)
        if name in found:
            raise QuadvisError(f"{name} is given twice, also as {quoted(word)}; give it once")
        found[name] = value
    return found
