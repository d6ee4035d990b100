"""`margin` and `limit` under `expect`: requirements on the loop, which `quadvis analyse` judges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

from quadvis.diagram.loop_requirements import (
    MARGINS,
    LoopRequirement,
    RequiredLimit,
    RequiredMargin,
    direction,
)
from quadvis.diagram.sections.analyse import ANALYSE, Cut, Limit
from quadvis.diagram.sections.context import Context
from quadvis.diagram.times import SECOND
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, DiagramError, Unknown, known, suggestion
from quadvis.units import Unit, read_ratio, split_quantity

RADIAN, HALF_TURN = Unit.parse("rad"), Unit.parse("deg").scale * 180.0
DIRECTIONS = ("above", "below")

Asked = TypeVar("Asked", Cut, Limit)


def read_margin(fields: YamlMap, context: Context) -> Iterator[LoopRequirement]:
    """Read ``{margin: torque, phase: 35 deg, delay: 40 ms}``, one requirement for each kind of margin."""
    faults = context.faults
    questions = context.values[ANALYSE]
    cut = _named(fields["margin"], "cut", questions.cuts, questions.named[0], context)
    if not any(kind in fields for kind in MARGINS):
        remedy = f"add one of {', '.join(MARGINS)}"
        faults.add(fields.place, "nothing is expected of the margin", remedy)
    fields = context.filled(fields, MARGINS)
    for kind in filter(fields.__contains__, MARGINS):
        node = fields[kind]
        least = faults.collect(_READERS[kind], node)
        if least is not None and known(cut):
            yield RequiredMargin(cut, kind, least, split_quantity(node.text())[1])


def read_limit(fields: YamlMap, context: Context) -> Iterator[LoopRequirement]:
    """Read ``{limit: vision latency, above: 300 ms}``."""
    faults = context.faults
    questions = context.values[ANALYSE]
    limit = _named(fields["limit"], "limit", questions.limits, questions.named[1], context)
    if not any(kind in fields for kind in DIRECTIONS):
        remedy = "add 'above', the value up to which the loop must be stable"
        faults.add(fields.place, "nothing is expected of the limit", remedy)
    fields = context.filled(fields, DIRECTIONS)
    if not known(limit):
        return
    for kind in filter(fields.__contains__, DIRECTIONS):
        least = faults.collect(_bound, fields[kind], kind, limit)
        if least is not None:
            yield RequiredLimit(limit, kind, least)


def _named(
    node: YamlNode, word: str, found: Sequence[Asked], named: tuple[str, ...] | Unknown, context: Context
) -> Asked | Unknown:
    """Return the cut or limit of `analyse` that a text names."""
    text = context.faults.collect(node.text)
    if text is not None and known(named) and text not in named:
        remedy = suggestion(text, named) or f"declare it under 'analyse: {{{word}s: ...}}'"
        context.faults.add(node.place, f"there is no {word} '{text}'", remedy)
    return next((each for each in found if each.label == text), UNKNOWN)


def _gain(node: YamlNode) -> float:
    value = node.read(read_ratio)
    if value <= 1.0:
        raise _too_small(node, "a factor above 1, or above 0 dB", "such as 2 or 6 dB")
    return value


def _phase(node: YamlNode) -> float:
    value = node.quantity(RADIAN, bare=False)
    if not 0.0 < value <= HALF_TURN:
        raise _too_small(node, "more than 0 deg and at most 180 deg", "such as 35 deg")
    return value


def _delay(node: YamlNode) -> float:
    value = node.quantity(SECOND, bare=False)
    if value <= 0.0:
        raise _too_small(node, "more than 0 s", "such as 40 ms")
    return value


_READERS = {"gain": _gain, "phase": _phase, "delay": _delay}


def _too_small(node: YamlNode, expected: str, example: str) -> DiagramError:
    return node.wrong(expected, f"write a margin {example}")


def _bound(node: YamlNode, kind: str, limit: Limit) -> float:
    value = node.quantity(limit.variable.unit, bare=False)
    wanted = direction(limit)
    ends = f"from {limit.shows(limit.start)} to {limit.shows(limit.end)}"
    if kind != wanted:
        raise node.fault(f"limit '{limit.label}' is sought {ends}", f"write '{wanted}'")
    if not min(limit.start, limit.end) <= value <= max(limit.start, limit.end):
        problem = f"'{kind}' is {limit.shows(value)}, but limit '{limit.label}' is sought {ends}"
        raise node.fault(problem, "write a value between these, or seek farther")
    return value
