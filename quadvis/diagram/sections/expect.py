"""`expect`: the requirements on a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from quadvis.diagram.requirements import EXPECTATIONS, Expectation
from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.forms import QUANTITY, SIGNAL, Schema, closed, list_of, ref
from quadvis.diagram.sections.section import Checked
from quadvis.diagram.sections.signals import STRETCH_KEYS, Asked, read_stretch
from quadvis.document import YamlNode
from quadvis.errors import UNKNOWN
from quadvis.output.statistics import COUNT
from quadvis.units import Unit, split_quantity

ONE = Unit()


class Expect(RunSection[Asked[Expectation]]):
    """The requirements that a run must meet."""

    key = "expect"
    words = (
        "requirements: `{signal, after, before, of}` with one of `within`, `rms`, `below`, `above`, `count`, "
        "`at_least`, see below"
    )

    def read(self, node: YamlNode | None, context: Context) -> Asked[Expectation]:
        """Return the expectations in the order of the file."""
        entries = context.faults.collect(node.items) if node is not None else None
        found = tuple(expectation for entry in entries or [] for expectation in _read(entry, context))
        return Asked(found, context.written(node))

    def schema(self) -> Schema:
        """Return the schema: a list of requirements."""
        return list_of(ref("expectation"), "what a run must show")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of one requirement."""
        keys = ("signal", *STRETCH_KEYS, *EXPECTATIONS)
        stretch: dict[str, Schema] = {key: QUANTITY for key in STRETCH_KEYS}
        kinds: dict[str, Schema] = {
            key: {**QUANTITY, "description": kind.words} for key, kind in EXPECTATIONS.items()
        }
        return {"expectation": closed(keys, {"signal": SIGNAL, **stretch, **kinds}, ["signal"])}

    def resolved(self, diagram: Checked) -> Any:
        """Return the requirements as they are written, with the full names of signals."""
        return diagram.values[self].written


def _read(node: YamlNode, context: Context) -> Iterator[Expectation]:
    """Read ``{signal: plant.position[0], after: 20 s, within: 0.15 m}``."""
    faults = context.faults
    fields = faults.collect(node.fields, ("signal",), (*STRETCH_KEYS, *EXPECTATIONS), faults)
    if fields is None:
        return
    found = read_stretch(fields, context)
    kinds = [kind for kind in EXPECTATIONS if kind in fields]
    if not kinds and all(key in ("signal", *STRETCH_KEYS) for key in fields):
        problem = "nothing is expected of the signal"
        faults.add(node.place, problem, f"add one of {', '.join(EXPECTATIONS)}")
    if found is UNKNOWN:
        return
    fields = context.filled(fields, kinds)
    for kind in filter(fields.__contains__, kinds):
        is_count = EXPECTATIONS[kind].statistic == COUNT
        unit = ONE if is_count else found.selection.unit
        limit = faults.collect(fields[kind].quantity, unit, bare=False)
        if limit is not None:
            shown = _written_unit(fields[kind]) or found.selection.shown
            selection = found.selection if is_count else replace(found.selection, shown=shown)
            yield Expectation(selection, kind, limit)


def _written_unit(node: YamlNode) -> Unit | None:
    """Return the unit in which a quantity was written."""
    unit = split_quantity(node.text())[1]
    return Unit.parse(unit) if unit else None


EXPECT = Expect()
