"""From flat blocks to drafts: parameters read, rates known, blocks made, constants typed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from quadvis.block import Block, Param, ParameterError
from quadvis.errors import DiagramError, Fault, Faults, QuadvisError, suggestion
from quadvis.expand import Expansion, FlatBlock
from quadvis.flow import Connection, Draft
from quadvis.graph import Constant, Task, Wire
from quadvis.loader import CONTINUOUS, FileSpec
from quadvis.values import OpenUnits, read_parameter, read_value
from quadvis.wiring import Wiring

NO_STEP = Fraction(1, 100)  # stands in for a solver step whose absence has been told


class Builder:
    """Makes the blocks; what has a fault is told and left out. ``step`` is that of the solver, if one is needed."""

    def __init__(self, spec: FileSpec, expansion: Expansion, wiring: Wiring, faults: Faults) -> None:
        self.spec, self.expansion, self.wiring, self.faults = spec, expansion, wiring, faults
        self.tasks = {
            name: Task(name, rate.period, rate.offset) for name, rate in spec.rates.items() if rate is not None
        }
        self.step = self._choose_step()

    def drafts(self) -> list[Draft]:
        """Return the blocks whose own entries are right."""
        found = []
        for flat in self.expansion.blocks.values():
            with self.faults.about(f"block '{flat.path}'"):
                draft = self._draft(flat)
            if draft is None:
                self.expansion.unknown.add(flat.path)
            else:
                found.append(draft)
        return found

    def _draft(self, flat: FlatBlock) -> Draft | None:
        if flat.kind is None:
            # The wires of a block that is not there may still be looked at.
            list(self.wiring.inputs(flat))
            return None
        task = self._task(flat, flat.kind)
        built = self._build(flat, flat.kind)
        connections = dict(self._connections(flat, flat.kind))
        if built is None:
            return None
        block, units = built
        places = {name: flat.place(name) for name in flat.parameters}
        return Draft(flat.path, flat.spec.place, flat.spec.kind, block, task, connections, places, units)

    def _choose_step(self) -> Fraction | None:
        """Take the solver's step if anything is continuous; every period must then be a whole number of steps."""
        first = next(filter(_is_continuous, self.expansion.blocks.values()), None)
        if first is None:
            return None
        step = self.spec.step
        if step is None:
            if not self.spec.step_told:
                problem = f"block '{first.path}' is continuous and the solver has no step"
                self.faults.add(first.spec.place, problem, "add 'solver: {method: ode4, step: 5 ms}'")
            return NO_STEP
        for name, rate in self.spec.rates.items():
            for what, time in (("period", rate.period), ("offset", rate.offset)) if rate is not None else ():
                if rate is not None and (time / step).denominator != 1:
                    problem = (
                        f"rates '{name}' and 'continuous' are not commensurate: the {what} of {float(time):g} s is "
                        f"not a whole number of solver steps of {float(step):g} s"
                    )
                    self.faults.add(rate.place, problem, "choose a step that divides it")
        return step

    def _task(self, flat: FlatBlock, kind: type[Block]) -> Task | None:
        """Return the task of a block; None if it is told to be wrong."""
        continuous = Task(CONTINUOUS, self.step or NO_STEP, continuous=True)
        own = flat.spec.rate
        if kind.interface.continuous:
            if own is not None and own[0] != CONTINUOUS:
                problem = f"{flat.spec.kind} has continuous states, rate '{own[0]}' cannot hold it"
                self.faults.add(own[1], problem, "leave 'rate' out, or write 'continuous'")
            return continuous
        names = [*self.spec.rates, CONTINUOUS]
        if flat.rate is None:
            choice = f"choose from {', '.join(names)}" if len(names) > 1 else "declare one under 'rates'"
            self.faults.add(flat.rateless, "key 'rate' is missing", choice)
            return None
        name, place = flat.rate
        if name == CONTINUOUS:
            return continuous
        if name not in self.spec.rates:
            self.faults.add(place, f"there is no rate '{name}'", suggestion(name, names) or "declare it under 'rates'")
        return self.tasks.get(name)

    def _build(self, flat: FlatBlock, kind: type[Block]) -> tuple[Block, dict[str, OpenUnits]] | None:
        declared = kind.interface.params
        values: dict[str, Any] = {}
        units: dict[str, OpenUnits] = {}
        whole = flat.path not in self.expansion.unknown
        for name, node in flat.parameters.items():
            if name not in declared:
                remedy = suggestion(name, declared) if declared else "it has none"
                self.faults.add(flat.place(name), f"{flat.spec.kind} has no parameter '{name}'", remedy)
                whole = False
                continue
            read = self.faults.collect(read_parameter, declared[name], node)
            if read is None or not self._accepts(declared[name], read[0], flat):
                whole = False
                continue
            values[name] = read[0]
            if read[1]:
                units[name] = read[1]
        for name, param in declared.items():
            if param.required and name not in flat.spec.parameters and name not in flat.parameters:
                wanted = "a path" if param.is_file else param.wanted()
                self.faults.add(flat.spec.place, f"parameter '{name}' is missing", f"give {wanted} under 'with'")
                whole = False
        block = self._construct(flat, kind, values) if whole else None
        return (block, units) if block is not None else None

    def _accepts(self, param: Param, value: Any, flat: FlatBlock) -> bool:
        try:
            param.accept(value)
        except ParameterError as error:
            self.faults.add(flat.parameters[param.name].place, str(error))
            return False
        return True

    def _construct(self, flat: FlatBlock, kind: type[Block], values: Mapping[str, Any]) -> Block | None:
        """Make the block, which checks its parameters against each other and reads its files."""
        try:
            return kind(**values)
        except ParameterError as error:
            node = flat.parameters.get(error.parameter)
            self.faults.add(node.place if node is not None else flat.spec.place, str(error))
        except DiagramError as error:
            for fault in error.faults:
                self.faults.append(self._from_file(fault, flat, values))
        except QuadvisError as error:
            self.faults.add(flat.spec.place, str(error))
        return None

    def _from_file(self, fault: Fault, flat: FlatBlock, values: Mapping[str, Any]) -> Fault:
        """Return a fault of a file that a parameter names; one of the file as a whole is put where it is named."""
        named = [flat.parameters[name] for name, value in values.items() if value == fault.place.file]
        if named and not fault.place.line:
            problem = f"'{named[0].text()}': {fault.problem}"
            return Fault(named[0].place, self.faults.subject, problem, fault.remedy)
        subject = f"{self.faults.subject}, {fault.subject}" if fault.subject else self.faults.subject
        return Fault(fault.place, subject, fault.problem, fault.remedy)

    def _connections(self, flat: FlatBlock, kind: type[Block]) -> Iterator[tuple[str, Connection]]:
        for port, source in self.wiring.inputs(flat):
            declared = kind.interface.inputs.get(port)
            if isinstance(source.source, Wire) or source.source is None or declared is None:
                wire = source.source if isinstance(source.source, Wire) else None
                yield port, Connection(source.place, wire, across=source.across)
            else:
                read = self.faults.collect(read_value, declared.signal, declared.units, source.source)
                value, units = (Constant(read[0]), read[1]) if read is not None else (None, ())
                yield port, Connection(source.place, value, units)


def _is_continuous(flat: FlatBlock) -> bool:
    named = flat.rate is not None and flat.rate[0] == CONTINUOUS
    return named or (flat.kind is not None and bool(flat.kind.interface.continuous))
