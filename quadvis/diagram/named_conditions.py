"""The conditions that blocks name by themselves under `condition`, as those of a resolved diagram do."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.diagram.conditional import run_of
from quadvis.diagram.expand import Expansion
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import ACTIVE, RESTART

CONDITION = "logic.run_condition"


def name_conditions(expansion: Expansion, faults: Faults) -> None:
    """Find the block that each `condition` names; refuse those of parts."""
    for flat in expansion.blocks.values():
        named = flat.spec.condition
        if named is None:
            continue
        with faults.about(f"block '{flat.path}'"):
            if flat.spec.runs is not None and known(named):
                problem = "both 'condition' and a condition of its own are given"
                faults.add(named[1], problem, "leave one of them out")
            flat.condition = _written(flat, named, expansion, faults) if known(named) else UNKNOWN
    for scope in _scopes(expansion.root):
        given = scope.instance.condition if scope.instance is not None else None
        if given is not None and known(given):
            with faults.about(scope.subject):
                faults.add(given[1], "'condition' is for a block, and this is a part", "write 'when'")


def _written(
    flat: FlatBlock, named: tuple[str, Place], expansion: Expansion, faults: Faults
) -> str | Unknown:
    name, place = named
    path = flat.scope.prefix + name
    found = expansion.blocks.get(path)
    if found is None:
        if expansion.knows(path):
            names = [each for each, other in expansion.blocks.items() if _is_condition(other)]
            remedy = suggestion(name, names) if names else f"use a block '{CONDITION}'"
            faults.add(place, f"there is no block '{name}'", remedy)
        return UNKNOWN
    if not _is_condition(found):
        if known(found.kind):
            faults.add(place, f"block '{name}' is no condition", f"name a block '{CONDITION}'")
        return UNKNOWN
    own, other = run_of(flat), run_of(found)
    if own is not None and other is not None and own != other:
        problem = f"'{name}' has another rate or computer than the block"
        faults.add(place, problem, "use a condition for each rate")
        return UNKNOWN
    return path


def _is_condition(flat: FlatBlock) -> bool:
    """Say whether a block can say when others run."""
    outputs = flat.kind.interface.outputs if known(flat.kind) else {}
    return all(name in outputs and outputs[name].type == "bool" for name in (ACTIVE, RESTART))


def _scopes(scope: Scope) -> Iterator[Scope]:
    """Yield the parts in a scope, outer ones first."""
    for child in scope.parts:
        yield child
        yield from _scopes(child)
