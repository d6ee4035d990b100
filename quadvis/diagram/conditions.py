"""Parts that do not always run: the blocks that say when they do, and those that show their outputs.

A part with `when`, `triggered` or `reset` has a block `logic.run_condition` for each of its rates and, if it
pauses, a block `logic.part_output` for each of its outputs. All checks see blocks and wires, and so does the
resolved diagram.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from quadvis.block import Block
from quadvis.diagram.expand import Expansion
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.blocks import BlockSpec
from quadvis.diagram.sections.conditional import PartCondition
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import ACTIVE, CONTINUOUS, RESTART, Wire

CONDITION, OUTPUT = "logic.run_condition", "logic.part_output"
ENABLED, SHOWN = "enabled", "shown"  # outputs of a condition, beside those that the engine reads
Run = tuple[str, str]  # a rate and a computer


class Conditions:
    """Adds the blocks of conditions to an expansion."""

    def __init__(self, expansion: Expansion, wiring: Wiring, faults: Faults) -> None:
        self.expansion, self.wiring, self.faults = expansion, wiring, faults
        self._blocks = expansion.blocks
        self._paths: dict[str, dict[Run, str]] = {}  # conditions by the prefix of their part
        self._shown: dict[tuple[str, str], str] = {}

    def add(self) -> None:
        """Add the blocks; a block under a condition then names it."""
        scopes = [scope for scope in _scopes(self.expansion.root) if scope.runs is not None]
        members = {scope.prefix: self._members(scope) for scope in scopes}
        for scope in scopes:
            if scope.runs.pauses:  # type: ignore[union-attr]
                for port in scope.spec[PORTS].outputs:
                    self._shown[scope.prefix, port] = self._free(scope.prefix + port)
        self.wiring.shown = {key: Wire(path, "y") for key, path in self._shown.items()}
        for scope in scopes:
            with self.faults.about(scope.subject):
                self._add_conditions(scope, members[scope.prefix])
        for flat in [*self._blocks.values()]:
            self._put_under(flat)
        for scope in reversed(scopes):  # inner ones first, since outer ones may show their outputs
            with self.faults.about(scope.subject):
                self._add_outputs(scope)
        self._name_written()

    def _members(self, scope: Scope) -> dict[Run, FlatBlock]:
        """Return the rates and computers of the blocks of a part, with the first block of each."""
        found: dict[Run, FlatBlock] = {}
        for path, flat in self._blocks.items():
            run = _run(flat)
            if path.startswith(scope.prefix) and run is not None:
                found.setdefault(run, flat)
        return found

    def _add_conditions(self, scope: Scope, runs: Mapping[Run, FlatBlock]) -> None:
        condition, instance = scope.runs, scope.instance
        assert condition is not None and instance is not None and scope.parent is not None
        runs = self._fitting(scope, condition, runs)
        kind = self.expansion.catalogue.find(CONDITION)
        values = {
            "states": condition.states,
            "outputs": condition.outputs,
            "trigger_on": condition.triggered.edge if condition.triggered else "never",
            "reset_on": condition.reset.edge if condition.reset else "never",
        }
        inputs = {"when": condition.when} if condition.when else {}
        inputs |= {"trigger": condition.triggered.signal} if condition.triggered else {}
        inputs |= {"reset": condition.reset.signal} if condition.reset else {}
        made = self._paths[scope.prefix] = {}
        for run in runs:
            name = "when" if len(runs) == 1 else "_".join(["when", *filter(None, run)])
            made[run] = path = self._free(scope.prefix + name)
            spec = BlockSpec(
                path.removeprefix(scope.prefix), condition.place, CONDITION, condition.place, False, {}, {},
                rate=(run[0], condition.place), at=(run[1], condition.place) if run[1] else None,
                inputs=dict(inputs),
            )  # fmt: skip
            around = self._around(scope.parent, run)
            wires = {f"around_{name}": Wire(around, name) for name in (ENABLED, ACTIVE)} if around else {}
            self._add(path, spec, scope.parent, kind, values, wires, around)

    def _add_outputs(self, scope: Scope) -> None:
        """Add what shows the outputs of a part."""
        condition, outputs = scope.runs, scope.spec[PORTS].outputs
        assert condition is not None
        for port, given in condition.initial.items():
            if port not in outputs:
                problem = f"the part has no output '{port}'"
                self.faults.add(given.place, problem, suggestion(port, outputs) if outputs else "")
        for port, reference in outputs.items() if condition.pauses else ():
            if not known(reference):
                continue
            source = self.wiring.inner(scope, port).source
            if source is UNKNOWN:
                continue
            flat = self._blocks.get(source.block) if isinstance(source, Wire) else None
            if flat is None or not flat.path.startswith(scope.prefix):
                problem = f"output '{port}' does not come from a block of the part, which may pause"
                remedy = "pass it through a block, such as signal.gain"
                self.faults.add(reference.place, problem, remedy)
                continue
            run = _run(flat)
            if not known(flat.kind) or run is None or run not in self._paths[scope.prefix]:
                continue
            assert isinstance(source, Wire)
            kind = flat.kind.interface.outputs[source.port].signal.scalar
            made = self.expansion.catalogue.find(OUTPUT).with_ports({"kind": kind})
            spec = BlockSpec(
                port, reference.place, OUTPUT, reference.place, False, {}, {},
                rate=(run[0], condition.place), at=(run[1], condition.place) if run[1] else None,
                inputs=self._initial(condition, port, kind),
            )  # fmt: skip
            wires = {"u": source, SHOWN: Wire(self._paths[scope.prefix][run], SHOWN)}
            path, around = self._shown[scope.prefix, port], self._around(scope.parent, run)
            self._add(path, spec, scope.parent or scope, made, {"kind": kind}, wires, around)

    def _initial(self, condition: PartCondition, port: str, kind: str) -> dict[str, InputSpec]:
        given = condition.initial.get(port)
        if given is None:
            return {}
        if kind == "frame":
            self.faults.add(given.place, f"output '{port}' is a picture, which has no value", "leave it out")
            return {}
        return {"initial": given}

    def _add(
        self,
        path: str,
        spec: BlockSpec,
        scope: Scope,
        kind: type[Block],
        values: Mapping[str, Any],
        wires: Mapping[str, Wire],
        around: str,
    ) -> None:
        place = spec.place
        nodes: dict[str, YamlNode | Unknown] = {
            name: YamlScalar(value, True, place.file, place.line, place.column) if known(value) else UNKNOWN
            for name, value in values.items()
        }
        places = dict.fromkeys(values, place)
        self._blocks[path] = FlatBlock(path, spec, scope, kind, nodes, places, wires, around)

    def _put_under(self, flat: FlatBlock) -> None:
        """Let a block of a part name the condition of its rate, of the innermost part that has one."""
        run = _run(flat)
        if run is not None and not flat.condition and flat.spec.condition is None:
            flat.condition = self._around(flat.scope, run)

    def _around(self, scope: Scope | None, run: Run) -> str:
        """Return the condition of a rate in a scope, or in the nearest one around it."""
        while scope is not None:
            if scope.prefix in self._paths:
                return self._paths[scope.prefix].get(run, "")
            scope = scope.parent
        return ""

    def _free(self, path: str) -> str:
        """Return a path that no block and no part has."""
        taken = {*self._blocks, *self._shown.values()}
        while path in taken or any(other.startswith(f"{path}/") for other in taken):
            path += "_"
        return path

    def _fitting(
        self, scope: Scope, condition: PartCondition, runs: Mapping[Run, FlatBlock]
    ) -> Mapping[Run, FlatBlock]:
        """Return the rates at which a part can run under a condition; report blocks that cannot."""
        for flat in self._blocks.values() if condition.sets_back else ():
            if flat.path.startswith(scope.prefix) and known(flat.kind) and flat.kind.keep is not Block.keep:
                problem = f"the states of '{flat.path}' lie outside of memory, and cannot be set back"
                self.faults.add(condition.place, problem, "say 'states: held', and leave 'reset' out")
        if condition.triggered is None:
            return runs
        place = condition.places["triggered"]
        for (rate, _), flat in runs.items():
            if rate == CONTINUOUS:
                problem = f"a triggered part runs at instants, and its block '{flat.path}' is continuous"
                remedy = "use a sampled one, such as signal.discrete_integrator, or write 'when'"
                self.faults.add(place, problem, remedy)
                return {}
        if len(runs) > 1:
            rates = " and ".join(dict.fromkeys(f"'{rate}'" for rate, _ in runs))
            problem = f"a triggered part has one rate, and this one has {rates}"
            self.faults.add(place, problem, "give all of its blocks the rate of the trigger")
            return {}
        return runs

    def _name_written(self) -> None:
        """Find the conditions that entries name by themselves, as those of a resolved diagram do."""
        for flat in self._blocks.values():
            named = flat.spec.condition
            if named is None:
                continue
            with self.faults.about(f"block '{flat.path}'"):
                flat.condition = self._written(flat, named) if known(named) else UNKNOWN

    def _written(self, flat: FlatBlock, named: tuple[str, Place]) -> str | Unknown:
        name, place = named
        path = flat.scope.prefix + name
        found = self._blocks.get(path)
        if found is None:
            if self.expansion.knows(path):
                names = [each for each, other in self._blocks.items() if _is_condition(other)]
                remedy = suggestion(name, names) if names else f"use a block '{CONDITION}'"
                self.faults.add(place, f"there is no block '{name}'", remedy)
            return UNKNOWN
        if not _is_condition(found):
            if known(found.kind):
                self.faults.add(place, f"block '{name}' is no condition", f"name a block '{CONDITION}'")
            return UNKNOWN
        own, other = _run(flat), _run(found)
        if own is not None and other is not None and own != other:
            problem = f"'{name}' has another rate or computer than the block"
            self.faults.add(place, problem, "use a condition for each rate")
            return UNKNOWN
        return path


def _is_condition(flat: FlatBlock) -> bool:
    """Say whether a block can say when others run."""
    outputs = flat.kind.interface.outputs if known(flat.kind) else {}
    return all(name in outputs and outputs[name].type == "bool" for name in (ACTIVE, RESTART))


def _run(flat: FlatBlock) -> Run | None:
    """Return the rate and the computer of a block; None if they are not known."""
    if not known(flat.kind) or flat.at is UNKNOWN:
        return None
    rate = (CONTINUOUS, None) if flat.kind.interface.continuous else flat.rate
    if rate is None or not known(rate):
        return None
    return rate[0], flat.at[0] if flat.at is not None and known(flat.at) else ""


def _scopes(scope: Scope) -> Iterator[Scope]:
    """Yield the parts in a scope, outer ones first."""
    for child in scope.parts:
        yield child
        yield from _scopes(child)


def with_conditions(expansion: Expansion, wiring: Wiring, faults: Faults) -> None:
    """Add to an expansion what says when its parts run; refuse conditions of what is no part."""
    for flat in expansion.blocks.values():
        runs = flat.spec.runs
        if runs is not None and known(runs):
            word = next(iter(runs.places))
            problem = f"'{word}' is for a part, and '{flat.spec.kind}' is a block"
            with faults.about(f"block '{flat.path}'"):
                faults.add(runs.place, problem, "put the block into a part")
    for scope in _scopes(expansion.root):
        named = scope.instance.condition if scope.instance is not None else None
        if named is not None and known(named):
            with faults.about(scope.subject):
                faults.add(named[1], "'condition' is for a block, and this is a part", "write 'when'")
    Conditions(expansion, wiring, faults).add()
