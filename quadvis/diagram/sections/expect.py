"""`expect`: the requirements on a run, and on the linearised loop."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from quadvis.diagram.ages import KEY, SECOND, read_route
from quadvis.diagram.loop_requirements import MARGINS, SENSITIVITIES, TRANSFERS, LoopRequirement
from quadvis.diagram.requirements import EXPECTATIONS, Expectation
from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.expect_loop import (
    DIRECTIONS,
    read_limit,
    read_margin,
    read_response,
    read_sensitivity,
)
from quadvis.diagram.sections.forms import QUANTITY, SIGNAL, TEXT, Schema, closed, list_of, ref
from quadvis.diagram.sections.section import Checked
from quadvis.diagram.sections.signals import STRETCH_KEYS, Asked, check_signal, in_stretch, read_stretch
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, closest, known
from quadvis.graph.graph import Wire
from quadvis.links.stamps import AGE
from quadvis.output.statistics import COUNT
from quadvis.units import Unit, split_quantity

ONE = Unit()
# What an expectation judges, by the key that names it, and the other keys.
FORMS: Mapping[str, tuple[str, ...]] = {
    "signal": (*STRETCH_KEYS, *EXPECTATIONS),
    "margin": tuple(MARGINS),
    **dict.fromkeys(SENSITIVITIES, ("below",)),
    "transfer": tuple(TRANSFERS),
    "limit": DIRECTIONS,
    KEY: ("after", "before", "below"),
}
# Those of the loop, with what reads them.
OF_LOOP: Mapping[str, Callable[[YamlMap, Context], Iterator[LoopRequirement]]] = {
    "margin": read_margin,
    **dict.fromkeys(SENSITIVITIES, read_sensitivity),
    "transfer": read_response,
    "limit": read_limit,
}


@dataclass(frozen=True)
class Expected(Asked[Expectation]):
    """The requirements on a run as ``items``; those on the loop, which an analysis must meet, as ``loop``."""

    loop: tuple[LoopRequirement, ...] = ()


class Expect(RunSection[Expected]):
    """The requirements that a run and its loop must meet."""

    key = "expect"
    words = (
        "requirements: `{signal, after, before, of}` with one of `within`, `rms`, `below`, `above`, `count`, "
        "`at_least`; `{age: [stamp, block], below}`; `{margin: cut}` with `gain`, `phase`, `delay`; "
        "`{sensitivity: cut, below}`; `{transfer}` with `bandwidth`, `overshoot` and others; "
        "`{limit, above}`, see below"
    )

    def read(self, node: YamlNode | None, context: Context) -> Expected:
        """Return the expectations in the order of the file."""
        entries = (context.faults.collect(node.items) if node is not None else None) or []
        found: list[Expectation] = []
        loop: list[LoopRequirement] = []
        of_run: list[YamlNode] = []
        for entry in entries:
            form = _form(entry)
            fields = context.faults.collect(entry.fields, (form,), FORMS[form], context.faults)
            if form in ("signal", KEY):
                of_run.append(entry)
                read = _read if form == "signal" else _read_age
                found += read(fields, context) if fields is not None else ()
            elif fields is not None and form in fields:
                loop += OF_LOOP[form](fields, context)
        written = [context.written(entry) for entry in of_run]
        return Expected(tuple(found), written or None, tuple(loop))

    def schema(self) -> Schema:
        """Return the schema: a list of requirements."""
        return list_of(ref("expectation"), "what a run must show")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of one requirement."""
        stretch: dict[str, Schema] = {key: QUANTITY for key in STRETCH_KEYS}
        kinds: dict[str, Schema] = {
            key: {**QUANTITY, "description": kind.words} for key, kind in EXPECTATIONS.items()
        }
        margins: dict[str, Schema] = {
            key: {**QUANTITY, "description": words} for key, words in MARGINS.items()
        }
        cut: Schema = {**TEXT, "description": "a cut under `analyse`"}
        of = {
            "signal": {"signal": SIGNAL, **stretch, **kinds},
            KEY: {
                KEY: list_of(TEXT, "a stamp, and the block that acts on what was measured then"),
                **{key: QUANTITY for key in STRETCH_KEYS[:2]},
                "below": {**QUANTITY, "description": "less than this age at each tick of the block"},
            },
            "margin": {"margin": cut, **margins},
            **{
                key: {key: cut, "below": {**QUANTITY, "description": "its peak is less: 2, or 6 dB"}}
                for key in SENSITIVITIES
            },
            "transfer": {
                "transfer": {**TEXT, "description": "a transfer under `analyse`"},
                **{key: {**QUANTITY, "description": kind.doc} for key, kind in TRANSFERS.items()},
            },
            "limit": {
                "limit": {**TEXT, "description": "a limit under `analyse`"},
                "above": {**QUANTITY, "description": "the value up to which the loop must be stable"},
                "below": {**QUANTITY, "description": "that down to which it must"},
            },
        }
        return {
            "expectation": {
                "anyOf": [closed((form, *keys), of[form], [form]) for form, keys in FORMS.items()]
            }
        }

    def resolved(self, diagram: Checked) -> Any:
        """Return the requirements on a run as they are written, with the full names of signals.

        Like `analyse`, those on the loop say nothing of a run, so they are not in its hash.
        """
        return diagram.values[self].written


def _form(node: YamlNode) -> str:
    """Return the key that says what is judged; a misspelt one counts."""
    keys = tuple(node.values) if isinstance(node, YamlMap) else ()
    near = (form for key in keys for form in [closest(key, FORMS)] if form is not None)
    return next((form for form in FORMS if form in keys), None) or next(near, "signal")


def _read(fields: YamlMap, context: Context) -> Iterator[Expectation]:
    """Read ``{signal: plant.position[0], after: 20 s, within: 0.15 m}``."""
    faults = context.faults
    found = read_stretch(fields, context)
    kinds = [kind for kind in EXPECTATIONS if kind in fields]
    if not kinds and all(key in ("signal", *STRETCH_KEYS) for key in fields):
        problem = "nothing is expected of the signal"
        faults.add(fields.place, problem, f"add one of {', '.join(EXPECTATIONS)}")
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


def _read_age(fields: YamlMap, context: Context) -> Iterator[Expectation]:
    """Read ``{age: [eyes.stamp, outputs.sent], below: 250 ms}``."""
    faults = context.faults
    if "below" not in fields:
        faults.add(fields.place, "nothing is expected of the age", "add 'below: 250 ms'")
    route = read_route(fields[KEY], context.wiring, faults) if KEY in fields else UNKNOWN
    if route is UNKNOWN:
        return
    for name, text in zip(fields[KEY].items(), route.written, strict=True):
        context.meant[name.place] = text
    fields = context.filled(fields, FORMS[KEY])
    limit = faults.collect(fields["below"].quantity, SECOND, bare=False) if "below" in fields else None
    if route.path not in context.nodes:
        return  # why it cannot be measured has been reported
    signal = check_signal(fields[KEY], Wire(route.path, AGE), context)
    found = in_stretch(signal, fields, context)
    if limit is not None and known(found):
        text = f"age of {route.written[0]} at {route.written[1]}"
        shown = _written_unit(fields["below"]) or SECOND
        yield Expectation(replace(found.selection, text=text, shown=shown), "below", limit)


def _written_unit(node: YamlNode) -> Unit | None:
    """Return the unit in which a quantity was written."""
    unit = split_quantity(node.text())[1]
    return Unit.parse(unit) if unit else None


EXPECT = Expect()
