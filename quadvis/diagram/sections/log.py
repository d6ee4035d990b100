"""`log`: which blocks are logged, and how often."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.forms import TEXT, Schema, closed, list_of, map_of
from quadvis.diagram.sections.section import Checked
from quadvis.document import YamlNode
from quadvis.errors import suggestion
from quadvis.links.stamps import METER

WILD = frozenset("*?[")  # characters of a pattern that stand for others
LOG_KEYS = ("signals", "every")


@dataclass
class Logged:
    """The paths of the blocks that are logged; of a task's rows one in ``every`` is, by name of the task."""

    paths: list[str]
    every: dict[str, int] = field(default_factory=dict)


class LogSection(RunSection[Logged]):
    """The signals that a run records."""

    key = "log"
    words = (
        "`{signals: [blocks, parts, signals or patterns], every: {rate: n}}`: "
        "what is logged (all by default), one row in n"
    )

    def read(self, node: YamlNode | None, context: Context) -> Logged:
        """Read ``{signals: [craft, "eyes/*"], every: {imu: 10}}``."""
        faults = context.faults
        found = Logged([path for path in context.nodes if path not in context.wiring.inner_blocks])
        fields = faults.collect(node.fields, (), LOG_KEYS, faults) if node is not None else None
        if fields is None:
            return found
        patterns = faults.collect(fields["signals"].items) if "signals" in fields else None
        if patterns is not None:
            named = _named(context)
            wanted = {path for pattern in patterns for path in _matching(pattern, named, context)}
            # What measures an age is there to be judged.
            found.paths = [
                path for path, node in context.nodes.items() if path in wanted or node.origin == METER
            ]
        tasks = {node.task.name for node in context.nodes.values()}
        every = faults.collect(fields["every"].mapping) if "every" in fields else None
        for key, value in every.pairs() if every is not None else []:
            count = faults.collect(value.integer)
            if key.value not in tasks and context.is_whole:
                problem = f"no block runs at a rate '{key.value}'"
                faults.add(key.place, problem, suggestion(key.value, tasks))
            elif count is not None and count < 1:
                faults.add(value.place, "a row cannot be kept more often than it comes", "write 1 or more")
            elif count is not None:
                found.every[key.value] = count
        return found

    def schema(self) -> Schema:
        """Return the schema: patterns, and numbers by rate."""
        return closed(LOG_KEYS, {
            "signals": list_of(TEXT, "blocks to log, or patterns such as 'vision/*'"),
            "every": map_of({"type": "integer", "minimum": 1}, "by rate: one row in so many"),
        })  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return the paths of all blocks that are logged."""
        logged = diagram.values[self]
        return {"signals": logged.paths, "every": logged.every}


def _named(context: Context) -> dict[str, list[str]]:
    """Return the blocks by the names that a pattern can match: their own, those of parts, of signals."""
    found: dict[str, list[str]] = {}
    inner = context.wiring.inner_blocks
    for (prefix, port), wire in context.wiring.shown.items():
        if prefix[:-1] in inner:
            found[f"{prefix[:-1]}.{port}"] = [wire.block]
    for path, node in context.nodes.items():
        if path in inner:
            continue
        names = path.split("/")
        around = ["/".join(names[:count]) for count in range(1, len(names) + 1)]
        for name in (*around, *(f"{path}.{port}" for port in node.block.interface.outputs)):
            found.setdefault(name, []).append(path)
    return found


def _matching(pattern: YamlNode, named: Mapping[str, list[str]], context: Context) -> list[str]:
    """Return the blocks that a pattern names."""
    text = context.faults.collect(pattern.text)
    if text is None:
        return []
    if WILD.isdisjoint(text):
        found = named.get(text, [])
    else:
        found = [path for name, paths in named.items() if fnmatchcase(name, text) for path in paths]
    if not found and context.is_whole:
        remedy = suggestion(text, context.nodes) or "write a block, a part, or a pattern such as 'eyes/*'"
        context.faults.add(pattern.place, f"no block is called '{text}'", remedy)
    return found


LOG = LogSection()
