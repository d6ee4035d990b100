"""Sentences that explain a rule behind a fault: of all faults that have one, the first shows it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from quadvis.errors.faults import Fault

ANGLES = (
    "an angle has a dimension of its own here, rad: an inertia is in kg*m^2/rad, "
    "a motor's constant in V*s/rad"
)
INTEGRALS = (
    "an integral is in its input's unit times s: let a rate of plain numbers be in 1/s, "
    "by a factor such as 'k: 1 1/s'"
)
_RULES = (ANGLES, INTEGRALS)


def ruled(remedy: str, rule: str) -> str:
    """Return a remedy with a rule behind it."""
    return "; ".join(filter(None, (remedy, rule)))


def each_rule_once(faults: Iterable[Fault]) -> Iterator[Fault]:
    """Yield faults, of which only the first explains a rule."""
    explained: set[str] = set()
    for fault in faults:
        rule = next((each for each in _RULES if fault.remedy.endswith(each)), "")
        if rule in explained:
            yield replace(fault, remedy=fault.remedy.removesuffix(rule).removesuffix("; "))
            continue
        explained |= {rule} - {""}
        yield fault
