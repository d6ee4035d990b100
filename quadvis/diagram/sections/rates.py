"""`rates`: when blocks run, by names of rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from quadvis.diagram.entries import named_entries
from quadvis.diagram.parameters import named_parameters
from quadvis.diagram.sections.forms import QUANTITY, Schema, closed, map_of, ref
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_duration, read_period
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import Faults, Place, Unknown
from quadvis.graph.graph import CONTINUOUS

RATE_KEYS = ("rate", "offset")


@dataclass(frozen=True)
class Rate:
    """When blocks run: period and offset (s), and where that is written.

    ``node`` is there if the period or the offset is a parameter, which `timing` reads; until then any number
    stands for the period.
    """

    period: Fraction
    offset: Fraction = Fraction(0)
    place: Place = field(default=Place(""), compare=False)
    node: YamlNode | None = field(default=None, compare=False)


Rates = dict[str, Rate | Unknown]


def read_rate(node: YamlNode) -> Rate:
    """Read ``20 Hz``, ``50 ms`` or ``{rate: 10 Hz, offset: 70 ms}``."""
    if not isinstance(node, YamlMap):
        return Rate(read_period(node), place=node.place)
    faults = Faults()
    node = node.fields(RATE_KEYS[:1], RATE_KEYS[1:], faults)
    period = faults.collect(read_period, node["rate"]) if "rate" in node else None
    offset = faults.collect(read_duration, node["offset"]) if "offset" in node else None
    faults.check()
    assert period is not None
    return Rate(period, offset or Fraction(0), node.place)


def _open_rate(node: YamlNode) -> Rate:
    return Rate(Fraction(1), place=node.place, node=node)


class RatesSection(FileSection[Rates]):
    """The rates of a diagram, by name."""

    key = "rates"
    words = (
        "named rates: `20 Hz`, `50 ms`, `1/30 s`, or `{rate: 10 Hz, offset: 70 ms}`; exact, no rounding; "
        "or `$name` of a parameter; `--set rates.name=...` replaces one; without `rates`, but with a "
        "`solver`, blocks run in continuous time where they say no `rate`"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Rates:
        """Return periods and offsets."""
        found: Rates = {}
        for name, value in named_entries(node, "rate", faults):
            is_open = bool(named_parameters(value))
            found[name] = _open_rate(value) if is_open else faults.read(read_rate, value)
            if name == CONTINUOUS:
                remedy = "choose another name, or set 'solver: {step: ...}'"
                faults.add(value.place, "'continuous' is the rate of the solver", remedy)
        return found

    def schema(self) -> Schema:
        """Return the schema: rates by name."""
        return map_of(ref("rate"), "named rates, such as 20 Hz or 50 ms")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the forms of one rate."""
        written = closed(RATE_KEYS, {"rate": QUANTITY, "offset": QUANTITY}, ["rate"])
        return {"rate": {"anyOf": [QUANTITY, written]}}

    def resolved(self, diagram: Checked) -> Any:
        """Return the rates that a block uses."""
        rates = {
            task.name: {"rate": f"{task.period} s", "offset": f"{task.offset} s"}
            if task.offset
            else f"{task.period} s"
            for task in diagram.graph.tasks
            if not task.continuous
        }
        return rates or None


RATES = RatesSection()
