"""`margin`, `sensitivity`, `transfer`, `limit` under `expect`: what `quadvis analyse` judges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TypeVar

from quadvis.diagram.loop_requirements import (
    MARGINS,
    SENSITIVITIES,
    TRANSFERS,
    LoopRequirement,
    RequiredLimit,
    RequiredMargin,
    RequiredSensitivity,
    RequiredTransfer,
    direction,
)
from quadvis.diagram.sections.analyse import ANALYSE, Limit
from quadvis.diagram.sections.context import Context
from quadvis.diagram.sections.cuts import Cut
from quadvis.diagram.sections.transfers import Transfer
from quadvis.diagram.times import SECOND
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, DiagramError, QuadvisError, Unknown, known, suggestion
from quadvis.units import Unit, read_ratio, split_quantity

HERTZ, RADIAN, HALF_TURN = Unit.parse("Hz"), Unit.parse("rad"), Unit.parse("deg").scale * 180.0
DIRECTIONS = ("above", "below")

Asked = TypeVar("Asked", Cut, Limit, Transfer)


def read_margin(fields: YamlMap, context: Context) -> Iterator[LoopRequirement]:
    """Read ``{margin: torque, phase: 35 deg, delay: 40 ms}``, one requirement for each kind of margin."""
    faults = context.faults
    questions = context.values[ANALYSE]
    cut = _named(fields["margin"], "cut", questions.cuts, "cuts", context)
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
    limit = _named(fields["limit"], "limit", questions.limits, "limits", context)
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


def read_sensitivity(fields: YamlMap, context: Context) -> Iterator[LoopRequirement]:
    """Read ``{sensitivity: torque, below: 2}``, or `complementary_sensitivity` in its place."""
    kind = next(iter(each for each in SENSITIVITIES if each in fields))
    cut = _named(fields[kind], "cut", context.values[ANALYSE].cuts, "cuts", context)
    if "below" not in fields:
        problem, remedy = "nothing is expected of the sensitivity", "add 'below', such as 2 or 6 dB"
        context.faults.add(fields.place, problem, remedy)
    fields = context.filled(fields, ("below",))
    most = context.faults.collect(_gain, fields["below"]) if "below" in fields else None
    if most is not None and known(cut):
        yield RequiredSensitivity(cut, kind, most, split_quantity(fields["below"].text())[1])


def read_response(fields: YamlMap, context: Context) -> Iterator[LoopRequirement]:
    """Read ``{transfer: reference, bandwidth: 3 Hz, overshoot: 20 %}``, one requirement for each kind."""
    faults, questions = context.faults, context.values[ANALYSE]
    transfer = _named(fields["transfer"], "transfer", questions.transfers, "transfer", context)
    if not any(kind in fields for kind in TRANSFERS):
        faults.add(fields.place, "nothing is expected of the transfer", f"add one of {', '.join(TRANSFERS)}")
    fields = context.filled(fields, TRANSFERS)
    if not known(transfer):
        return
    for kind in filter(fields.__contains__, TRANSFERS):
        bound = faults.collect(_response, fields[kind], kind, transfer)
        if bound is not None:
            yield RequiredTransfer(transfer, kind, bound, split_quantity(fields[kind].text())[1])


def _response(node: YamlNode, kind: str, transfer: Transfer) -> float:
    """Return a bound of a transfer in SI units."""
    if kind == "resonance":
        value = node.read(read_ratio)
    elif kind == "bandwidth" and _is_in_hertz(node.text()):
        value = 2.0 * math.pi * node.quantity(HERTZ, bare=False)
    else:
        unit = TRANSFERS[kind].unit
        value = node.quantity(Unit.parse(unit) if unit else transfer.unit, bare=False)
    if value < 0.0 or (value == 0.0 and kind != "overshoot"):
        raise node.wrong("more than 0", "write how much it may be, such as 3 Hz, 20 % or 2 s")
    return value


def _is_in_hertz(text: str) -> bool:
    """Return whether a frequency is written in Hz; one that is no quantity is a fault elsewhere."""
    try:
        return Unit.parse(split_quantity(text)[1]).dimension_equals(HERTZ)
    except QuadvisError:
        return False


def _named(node: YamlNode, word: str, found: Sequence[Asked], key: str, context: Context) -> Asked | Unknown:
    """Return the cut, transfer or limit of `analyse` that a text names."""
    text, named = context.faults.collect(node.text), context.values[ANALYSE].named[key]
    if text is not None and known(named) and text not in named:
        remedy = suggestion(text, named) or f"declare it under 'analyse: {{{key}: ...}}'"
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
