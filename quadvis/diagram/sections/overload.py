"""`overload`: what happens in a real-time run when tasks miss their ticks; the limits are xPC Target's."""

from __future__ import annotations

from typing import Any, NamedTuple

from quadvis.diagram.sections.forms import Schema, closed
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults

COUNTS = ("max", "consecutive", "startup")
OVERLOAD_KEYS = (*COUNTS, "action")
STOP, WARN = ACTIONS = ("stop", "warn")
LARGEST = 10**9


class OverloadLimits(NamedTuple):
    """How many overruns each task may have: ``max`` in all, ``consecutive`` in a row (None: no own limit).

    Overruns that one of the first ``startup`` steps of any task causes do not count. ``action`` says what
    follows one overrun too many: the run stops, or goes on with a warning.
    """

    max: int = 0
    consecutive: int | None = None
    startup: int = 5
    action: str = STOP


class OverloadSection(FileSection[OverloadLimits]):
    """How many overruns a real-time run may have."""

    key = "overload"
    words = (
        "`{max: 0, consecutive: n, startup: 5, action: stop or warn}`: how many ticks each task may miss in "
        "a real-time run, in all and in a row, apart from what the first steps of a task cause; and what "
        "follows one more"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> OverloadLimits:
        """Return the limits."""
        fields = faults.collect(node.fields, (), OVERLOAD_KEYS, faults) if node is not None else None
        if fields is None:
            return OverloadLimits()
        found: dict[str, Any] = {}
        for name in COUNTS:
            count = faults.collect(fields[name].integer) if name in fields else None
            if count is not None and not 0 <= count <= LARGEST:
                faults.add(fields[name].place, f"'{name}' must be from 0 to {LARGEST}", "write one such as 3")
            elif count is not None:
                found[name] = count
        action = faults.collect(fields["action"].choice, ACTIONS) if "action" in fields else None
        return OverloadLimits(**found, action=action or STOP)

    def schema(self) -> Schema:
        """Return the schema: three numbers and a word."""
        number: Schema = {"type": "integer", "minimum": 0, "maximum": LARGEST}
        return closed(OVERLOAD_KEYS, {
            "max": {**number, "description": "ticks that each task may miss in all; 0 if left out"},
            "consecutive": {**number, "description": "ticks that each task may miss in a row"},
            "startup": {**number, "description": "first steps of each task, which may last; 5 if left out"},
            "action": {"enum": list(ACTIONS), "description": "what follows one missed tick too many"},
        })  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return what is not the default, so that the hashes of other diagrams stay the same."""
        limits, usual = diagram.values[self], OverloadLimits()
        found = {name: value for name, value in limits._asdict().items() if value != getattr(usual, name)}
        return found or None


OVERLOAD = OverloadSection()
