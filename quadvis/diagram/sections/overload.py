"""`overload`: what happens in a real-time run when tasks miss their ticks; the limits are xPC Target's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from quadvis.diagram.sections.forms import Schema, closed, map_of
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import Faults, Place, suggestion
from quadvis.graph.graph import Graph

COUNTS = ("max", "consecutive", "startup")
LIMIT_KEYS = (*COUNTS, "action")
OVERLOAD_KEYS = (*LIMIT_KEYS, "tasks")
STOP, SAFE, WARN = ACTIONS = ("stop", "safe", "warn")
LARGEST = 10**9


class OverloadLimits(NamedTuple):
    """How many overruns each task may have: ``max`` in all, ``consecutive`` in a row (None: no own limit).

    Overruns that one of the first ``startup`` steps of any task causes do not count. ``action`` says what
    follows one overrun too many: the run stops; or its outputs take their safe values and hold them; or it
    goes on with a warning. ``tasks`` have limits of their own.
    """

    max: int = 0
    consecutive: int | None = None
    startup: int = 5
    action: str = STOP
    tasks: tuple[TaskLimits, ...] = ()

    def of(self, task: str) -> OverloadLimits:
        """Return the limits of a task."""
        return next((each.limits for each in self.tasks if each.name == task), self)


class TaskLimits(NamedTuple):
    """The limits of one task, and the place where they are written."""

    name: str
    limits: OverloadLimits
    place: Place


USUAL = OverloadLimits()


class OverloadSection(FileSection[OverloadLimits]):
    """How many overruns a real-time run may have."""

    key = "overload"
    words = (
        "`{max: 0, consecutive: n, startup: 5, action: stop, safe or warn, tasks: {rate: {max: 2}}}`: "
        "how many ticks each task may miss in a real-time run, see below"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> OverloadLimits:
        """Return the limits."""
        fields = faults.collect(node.fields, (), OVERLOAD_KEYS, faults) if node is not None else None
        if fields is None:
            return OverloadLimits()
        usual = OverloadLimits(**_limits(fields, faults))
        tasks = []
        given = faults.collect(fields["tasks"].mapping) if "tasks" in fields else None
        for key, value in given.pairs() if given is not None else []:
            own = faults.collect(value.fields, (), LIMIT_KEYS, faults)
            if own is not None:
                tasks.append(TaskLimits(key.value, usual._replace(**_limits(own, faults)), key.place))
        return usual._replace(tasks=tuple(tasks))

    def schema(self) -> Schema:
        """Return the schema: three numbers and a word, and again by task."""
        number: Schema = {"type": "integer", "minimum": 0, "maximum": LARGEST}
        forms: Mapping[str, Schema] = {
            "max": {**number, "description": "ticks that each task may miss in all; 0 if left out"},
            "consecutive": {**number, "description": "ticks that each task may miss in a row"},
            "startup": {**number, "description": "first steps of each task, which may last; 5 if left out"},
            "action": {"enum": list(ACTIONS), "description": "what follows one missed tick too many"},
        }
        tasks = map_of(closed(LIMIT_KEYS, forms), "limits of single tasks, by their rates")
        return closed(OVERLOAD_KEYS, {**forms, "tasks": tasks})

    def resolved(self, diagram: Checked) -> Any:
        """Return what is not the default, so that the hashes of other diagrams stay the same."""
        return plain(diagram.values[self]) or None


def plain(limits: OverloadLimits, usual: OverloadLimits = USUAL) -> dict[str, Any]:
    """Return limits as a diagram writes them, without what is as usual."""
    found = {
        name: getattr(limits, name) for name in LIMIT_KEYS if getattr(limits, name) != getattr(usual, name)
    }
    if limits.tasks:
        found["tasks"] = {each.name: plain(each.limits, limits) for each in limits.tasks}
    return found


def written(limits: OverloadLimits) -> dict[str, Any]:
    """Return limits in full as a diagram writes them."""
    found = {name: getattr(limits, name) for name in LIMIT_KEYS if getattr(limits, name) is not None}
    return {**found, **({"tasks": plain(limits)["tasks"]} if limits.tasks else {})}


def warn_tasks(limits: OverloadLimits, graph: Graph, faults: Faults) -> None:
    """Warn of limits for a task that a diagram does not have."""
    names = [task.name for task in graph.tasks]
    for each in limits.tasks:
        if each.name not in names:
            faults.warn(each.place, f"no block runs at the rate '{each.name}'", suggestion(each.name, names))


def _limits(fields: YamlMap, faults: Faults) -> dict[str, Any]:
    """Return the limits that are written."""
    found: dict[str, Any] = {}
    for name in COUNTS:
        count = faults.collect(fields[name].integer) if name in fields else None
        if count is not None and not 0 <= count <= LARGEST:
            faults.add(fields[name].place, f"'{name}' must be from 0 to {LARGEST}", "write one such as 3")
        elif count is not None:
            found[name] = count
    action = faults.collect(fields["action"].choice, ACTIONS) if "action" in fields else None
    return found | ({"action": action} if action else {})


OVERLOAD = OverloadSection()
