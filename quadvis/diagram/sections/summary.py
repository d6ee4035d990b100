"""`summary`: the lines that are shown at the end of a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from quadvis.diagram.requirements import Entry
from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.forms import QUANTITY, SIGNAL, TEXT, Schema, closed, labelled, list_of, ref
from quadvis.diagram.sections.section import Checked
from quadvis.diagram.sections.signals import STRETCH_KEYS, Asked, read_stretch
from quadvis.diagram.unit_flow import words
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Unknown, known
from quadvis.output.statistics import COUNT, STATISTICS

SUMMARY_KEYS = (*STRETCH_KEYS, "show", "unit")


class Summary(RunSection[Asked[Entry]]):
    """The lines of the summary, by label."""

    key = "summary"
    words = (
        "lines of the summary: `label: {signal, after, before, of, show: [rms, max, mean, lowest, highest, "
        "final, count], unit}`, or just the signal"
    )

    def read(self, node: YamlNode | None, context: Context) -> Asked[Entry]:
        """Return the lines in the order of the file."""
        entries = context.faults.collect(node.mapping) if node is not None else None
        read = (
            [_read(key.value, entry, context) for key, entry in entries.pairs()]
            if entries is not None
            else []
        )
        return Asked(tuple(entry for entry in read if known(entry)), context.written(node))

    def schema(self) -> Schema:
        """Return the schema: lines by label."""
        return labelled({"anyOf": [ref("signal"), ref("entry")]}, "lines of the summary by their labels")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of one line."""
        stretch: dict[str, Schema] = {key: QUANTITY for key in STRETCH_KEYS}
        shown = list_of({"enum": list(STATISTICS)}, "statistics to show")
        fields = {"signal": SIGNAL, **stretch, "show": shown, "unit": TEXT}
        return {"entry": closed(("signal", *SUMMARY_KEYS), fields, ["signal"])}

    def resolved(self, diagram: Checked) -> Any:
        """Return the lines as they are written, with the full names of signals."""
        return diagram.values[self].written


def _read(label: str, node: YamlNode, context: Context) -> Entry | Unknown:
    """Read a line of the summary: ``x: {signal: plant.position[0], after: 40 s, show: [rms, max]}``."""
    faults = context.faults
    if not isinstance(node, YamlMap):
        node = YamlMap({}, {"signal": node}, node.file, node.line, node.column)
    fields = faults.collect(node.fields, ("signal",), SUMMARY_KEYS, faults)
    if fields is None:
        return UNKNOWN
    found = read_stretch(fields, context)
    names = faults.collect(fields["show"].items) if "show" in fields else None
    show = [faults.collect(name.choice, STATISTICS) for name in names or []]
    unit = faults.collect(fields["unit"].unit) if "unit" in fields else None
    if found is UNKNOWN:
        return UNKNOWN
    selection = found.selection
    if unit is not None and not unit.dimension_equals(selection.unit):
        problem = f"'{selection.text}' has {words(selection.unit)}, which is not shown in {words(unit)}"
        faults.add(fields["unit"].place, problem, "write a unit of the same kind")
    default = ("rms", "max") if found.scalar == "float64" else (COUNT,)
    shown = tuple(name for name in show if name is not None) or default
    return Entry(label, replace(selection, shown=unit or selection.shown), shown)


SUMMARY = Summary()
