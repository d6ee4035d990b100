"""Parts and blocks that do not always run: what says when they do, and what shows their outputs.

A part with `when`, `triggered` or `reset` has a block `logic.run_condition` for each of its rates and, if it
pauses, a block `logic.part_output` for each of its outputs. A block with these keys has a condition of its
own, and the same for its outputs where it does not hold them by itself. All checks see blocks and wires, and
so does the resolved diagram.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from quadvis.block import Block
from quadvis.diagram.conditional import Conditional, Run, conditional_blocks, conditional_parts, run_of
from quadvis.diagram.expand import Expansion
from quadvis.diagram.named_conditions import CONDITION, name_conditions
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.blocks import BlockSpec
from quadvis.diagram.sections.conditional import PartCondition
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Unknown, known, suggestion
from quadvis.graph.graph import ACTIVE, CONTINUOUS, Wire

OUTPUT = "logic.part_output"
ENABLED, SHOWN = "enabled", "shown"  # outputs of a condition, beside those that the engine reads


class Conditions:
    """Adds the blocks of conditions to an expansion."""

    def __init__(self, expansion: Expansion, wiring: Wiring, faults: Faults) -> None:
        self.expansion, self.wiring, self.faults = expansion, wiring, faults
        self._blocks = expansion.blocks
        self._paths: dict[str, dict[Run, str]] = {}  # conditions by the prefix of their part or block
        self._shown: dict[tuple[str, str], str] = {}

    def add(self) -> None:
        """Add the blocks; a block under a condition then names it."""
        # Outer ones first, since the condition of an inner one reads theirs.
        each = [*conditional_parts(self.expansion.root), *conditional_blocks(self.expansion)]
        members = {one.prefix: one.members(self._blocks) for one in each}
        for one in each:
            for port in one.shown:
                self._shown[one.prefix, port] = self._free(one.prefix + port)
        self.wiring.shown = {key: Wire(path, "y") for key, path in self._shown.items()}
        for one in each:
            with self.faults.about(one.subject):
                self._add_conditions(one, members[one.prefix])
        for flat in [*self._blocks.values()]:
            self._put_under(flat)
        for one in reversed(each):  # inner ones first, since outer ones may show their outputs
            with self.faults.about(one.subject):
                self._add_outputs(one)
        name_conditions(self.expansion, self.faults)

    def _add_conditions(self, one: Conditional, runs: Mapping[Run, FlatBlock]) -> None:
        condition = one.runs
        runs = self._fitting(one, runs)
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
        made = self._paths[one.prefix] = {}
        for run in runs:
            name = "when" if len(runs) == 1 else "_".join(["when", *filter(None, run)])
            made[run] = path = self._free(one.prefix + name)
            spec = BlockSpec(
                path.removeprefix(one.prefix), condition.place, CONDITION, condition.place, False, {}, {},
                rate=(run[0], condition.place), at=(run[1], condition.place) if run[1] else None,
                inputs=dict(inputs),
            )  # fmt: skip
            around = self._around(one.around, run)
            wires = {f"around_{name}": Wire(around, name) for name in (ENABLED, ACTIVE)} if around else {}
            self._add(path, spec, one.around, kind, values, wires, around)

    def _add_outputs(self, one: Conditional) -> None:
        """Add what shows the outputs of a part or a block."""
        for port, given in one.runs.initial.items():
            if port not in one.outputs and not (one.block is not None and one.block.kind is UNKNOWN):
                problem = f"the {one.word} has no output '{port}'"
                self.faults.add(given.place, problem, suggestion(port, one.outputs) if one.outputs else "")
        for port in one.shown:
            self._add_output(one, port)

    def _add_output(self, one: Conditional, port: str) -> None:
        condition, found, place = one.runs, one.source(port, self.wiring), one.outputs[port]
        if found is None:
            return
        source = found.source
        flat = self._blocks.get(source.block) if isinstance(source, Wire) else None
        if flat is None or not (one.has(flat) or flat.path.startswith(one.prefix)):
            problem = f"output '{port}' does not come from a block of the part, which may pause"
            self.faults.add(place, problem, "pass it through a block, such as signal.gain")
            return
        run = run_of(flat)
        if not known(flat.kind) or run is None or run not in self._paths[one.prefix]:
            return
        assert isinstance(source, Wire)
        kind = flat.kind.interface.outputs[source.port].signal.scalar
        made = self.expansion.catalogue.find(OUTPUT).with_ports({"kind": kind})
        spec = BlockSpec(
            port, place, OUTPUT, place, False, {}, {},
            rate=(run[0], condition.place), at=(run[1], condition.place) if run[1] else None,
            inputs=self._initial(condition, port, kind),
        )  # fmt: skip
        wires = {"u": source, SHOWN: Wire(self._paths[one.prefix][run], SHOWN)}
        path, around = self._shown[one.prefix, port], self._around(one.around, run)
        self._add(path, spec, one.around, made, {"kind": kind}, wires, around)

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
        """Let a block name its own condition, or that of its rate of the innermost part that has one."""
        run = run_of(flat)
        if run is None or flat.condition or flat.spec.condition is not None:
            return
        own = self._paths.get(f"{flat.path}/")
        flat.condition = self._around(flat.scope, run) if own is None else own.get(run, "")

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

    def _fitting(self, one: Conditional, runs: Mapping[Run, FlatBlock]) -> Mapping[Run, FlatBlock]:
        """Return the rates at which a part or a block can run; report blocks that cannot."""
        condition = one.runs
        for flat in self._blocks.values() if condition.sets_back else ():
            if one.has(flat) and known(flat.kind) and flat.kind.keep is not Block.keep:
                problem = f"the states of '{flat.path}' lie outside of memory, and cannot be set back"
                self.faults.add(condition.place, problem, "say 'states: held', and leave 'reset' out")
        if condition.triggered is None:
            return runs
        place = condition.places["triggered"]
        for (rate, _), flat in runs.items():
            if rate == CONTINUOUS:
                which = f"its block '{flat.path}'" if one.part is not None else "this one"
                problem = f"a triggered {one.word} runs at instants, and {which} is continuous"
                remedy = "use a sampled one, such as signal.discrete_integrator, or write 'when'"
                self.faults.add(place, problem, remedy)
                return {}
        if len(runs) > 1:
            rates = " and ".join(dict.fromkeys(f"'{rate}'" for rate, _ in runs))
            problem = f"a triggered part has one rate, and this one has {rates}"
            self.faults.add(place, problem, "give all of its blocks the rate of the trigger")
            return {}
        return runs
