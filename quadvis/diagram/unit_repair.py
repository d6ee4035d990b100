"""Units that do not fit: several wires that one value makes wrong are one fault, at that value.

Which value that is, is tried out: the units flow again with a unit that is as much larger or smaller as the
first wires are wrong. If wires fit then that did not, the value is to blame.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from quadvis.diagram.draft import Draft, DraftWire, Key
from quadvis.diagram.flow import Cases
from quadvis.diagram.unit_flow import UnitFlow, words
from quadvis.diagram.values import OpenUnits
from quadvis.errors import Fault, Faults, Place
from quadvis.errors.rules import ANGLES, INTEGRALS, ruled
from quadvis.graph.graph import Constant, Node
from quadvis.units import Unit

MOST_WORK = 5_000  # blocks that are looked at in all trials together


class _Trial(Faults):
    """Faults that nobody sees; their number has no limit."""

    LIMIT = 10**9


class _Value(NamedTuple):
    """A value with a unit: where it is written, the parameters and constants that take it, and a factor."""

    place: Place
    keys: tuple[Key, ...]
    unit: Unit
    factor: Unit


def follow_units(
    drafts: Mapping[str, Draft],
    nodes: Mapping[str, Node],
    links: Sequence[DraftWire],
    unknown: Collection[Key],
    faults: Faults,
    cases: Cases,
) -> UnitFlow:
    """Let the units flow along the wires, note them in the nodes, and report units that do not fit."""

    def flow(changed: Mapping[Key, Unit]) -> UnitFlow:
        found = UnitFlow(drafts, nodes, links, unknown, _Trial(), cases)
        found.changed = changed
        found.run()
        return found

    found = flow({})
    blames: list[Fault] = []
    ratios: dict[Place, Unit] = {}
    work = MOST_WORK
    while _is_chain(found) and work > 0:
        best: list[tuple[_Value, UnitFlow]] = []
        for value in _values(found):
            trial = flow({**found.changed, **dict.fromkeys(value.keys, value.factor)})
            work -= len(drafts)
            if _count(trial) < _count(found) - 1 and _places(trial) < _places(found):
                least = min(_count(flow) for _, flow in (*best, (value, trial)))
                best = [pair for pair in (*best, (value, trial)) if _count(pair[1]) == least]
            if work <= 0:
                break
        if not best:
            break
        value, trial = best[0]
        gone = [fault for fault in found.faults if fault.place not in {other.place for other in trial.faults}]
        # If several values could be to blame, the beginning of the chain stands for all of it.
        blamed = _blame(drafts, value, len(gone)) if len(best) == 1 else gone[0]
        blames.append(blamed)
        ratios[blamed.place] = value.factor
        found = trial
    for fault in (*blames, *found.faults):
        ratio = (ratios | found.ratios | found.given_ratios).get(fault.place)
        rule = ANGLES if ratio is not None and ratio.is_angle else ""
        rule = rule or (INTEGRALS if fault.place in found.integrals else "")
        faults.append(replace(fault, remedy=ruled(fault.remedy, rule)))
    found.note()
    return found


def _is_chain(flow: UnitFlow) -> bool:
    """Say whether one value may be behind several faults.

    Values that do not fit the wires that they meet are reported where they stand, unless they lack only an
    angle.
    """
    return _count(flow) > 1 and (
        bool(flow.ratios) or all(ratio.is_angle for ratio in flow.given_ratios.values())
    )


def _count(flow: UnitFlow) -> int:
    return len(flow.ratios) + len(flow.given_ratios)


def _places(flow: UnitFlow) -> set[Place]:
    return {fault.place for fault in flow.faults}


def _values(flow: UnitFlow) -> Iterator[_Value]:
    """Yield the possible causes: each value with a unit, and each factor that is missing somewhere."""
    ratios = list(dict.fromkeys((*flow.ratios.values(), *flow.given_ratios.values())))[:3]
    factors = list(dict.fromkeys(factor for ratio in ratios for factor in (ratio**-1, ratio)))
    found: dict[Place | Key, tuple[Place, list[Key], Unit]] = {}
    for path, draft in sorted(flow.drafts.items()):
        for name, units in (*draft.units.items(), *_constants(draft)):
            fixed = [unit for unit in units if isinstance(unit, Unit)]
            origin = draft.origin(name)
            # A value of the command line has no place of its own.
            key = origin if origin.line else (path, name)
            if fixed and (path, name) not in flow.changed:
                found.setdefault(key, (origin, [], fixed[0]))[1].append((path, name))
    for place, keys, unit in found.values():
        yield from (_Value(place, tuple(keys), unit, factor) for factor in factors)


def _constants(draft: Draft) -> Iterator[tuple[str, OpenUnits]]:
    for port, connection in draft.connections.items():
        if isinstance(connection.source, Constant):
            yield port, connection.units


def _blame(drafts: Mapping[str, Draft], value: _Value, count: int) -> Fault:
    path, name = value.keys[0]
    right = value.unit * value.factor.reduced
    problem = f"'{name}' has {words(value.unit)}, with which {count} units do not fit"
    remedy = f"all fit if it is in {words(right)}" if right.exponents else "all fit without a unit"
    return Fault(value.place, f"block '{path}'", problem, remedy)
