"""From flat blocks to drafts: parameters read, rates known, blocks made, constants typed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from quadvis.block import Block, Param, ParameterError
from quadvis.diagram.expand import Expansion, FlatBlock
from quadvis.diagram.flow import Connection, Draft
from quadvis.diagram.names import absent, remedy_for
from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.solver import SOLVER
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.times import time_text
from quadvis.diagram.values import OpenUnits, read_parameter, read_value
from quadvis.diagram.wiring import Wiring
from quadvis.engine.graph import CONTINUOUS, Constant, Task, Wire, common_divisor
from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError, suggestion

# By path, class, parameters and period: variants share most.
Made = dict[tuple[str, type[Block], str, Fraction | None], Block]
NO_STEP = Fraction(1, 100)  # stands in for a solver step whose absence has been told


class Builder:
    """Makes the blocks and tells what is wrong with them. ``step`` is the solver's, if one is needed."""

    def __init__(
        self, spec: FileSpec, expansion: Expansion, wiring: Wiring, made: Made, faults: Faults
    ) -> None:
        self.spec, self.expansion, self.wiring, self.made, self.faults = spec, expansion, wiring, made, faults
        self.tasks = {
            name: Task(name, rate.period, rate.offset)
            for name, rate in spec[RATES].items()
            if rate is not None
        }
        self.step = self._choose_step()

    def drafts(self) -> list[Draft]:
        """Return the blocks whose own entries are right."""
        found = []
        for flat in self.expansion.blocks.values():
            with self.faults.about(f"block '{flat.path}'"):
                draft = self._draft(flat)
            if draft is not None:
                found.append(draft)
        return found

    def _draft(self, flat: FlatBlock) -> Draft | None:
        if flat.kind is None:
            # The wires of a block that is not there may still be looked at.
            list(self.wiring.inputs(flat))
            return None
        task = self._task(flat, flat.kind)
        block, units = self._build(flat, flat.kind, task)
        connections = dict(self._connections(flat, flat.kind))
        places = {name: flat.place(name) for name in flat.parameters}
        origins = {name: node.place for name, node in flat.parameters.items()}
        told = "in" in flat.spec.told
        return Draft(
            flat.path, flat.spec.place, flat.spec.kind, block, task, connections, places, units, origins, told
        )

    def _choose_step(self) -> Fraction | None:
        """Take the solver's step if anything is continuous; every period must be a whole number of steps."""
        first = next(filter(_is_continuous, self.expansion.blocks.values()), None)
        if first is None:
            return None
        step = self.spec[SOLVER].step
        if step is None:
            if not self.spec[SOLVER].told:
                problem = f"block '{first.path}' is continuous and the solver has no step"
                self.faults.add(first.spec.place, problem, "add 'solver: {method: ode4, step: 5 ms}'")
            return NO_STEP
        used = {flat.rate[0] for flat in self.expansion.blocks.values() if flat.rate is not None}
        times = {
            f"the {what} of '{task.name}' ({time_text(time)})": time
            for task in self.tasks.values()
            for what, time in (("period", task.period), ("offset", task.offset))
            if task.name in used and time
        }
        unfit = [words for words, time in times.items() if (time / step).denominator != 1]
        if unfit:
            fitting = common_divisor([*times.values()])
            fitting /= math.ceil(fitting / step)
            problem = f"a step of {time_text(step)} is not commensurate with {' and '.join(unfit)}"
            remedy = f"choose one that divides them all, such as '{time_text(fitting)}'"
            self.faults.add(self.spec[SOLVER].place or self.spec.place, problem, remedy)
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
        names = [*self.spec[RATES], CONTINUOUS]
        if flat.rate is None:
            entries = list(flat.around)
            if not any("rate" in entry.told for entry in entries):
                choice = f"choose from {', '.join(names)}" if len(names) > 1 else "declare one under 'rates'"
                self.faults.add(entries[-1].place, "key 'rate' is missing", choice)
            return None
        name, place = flat.rate
        if name == CONTINUOUS:
            return continuous
        if name not in self.spec[RATES]:
            remedy = suggestion(name, names) if self.spec[RATES] else ""
            self.faults.add(place, f"there is no rate '{name}'", remedy or "declare it under 'rates'")
        return self.tasks.get(name)

    def _build(
        self, flat: FlatBlock, kind: type[Block], task: Task | None
    ) -> tuple[Block | type[Block], dict[str, OpenUnits]]:
        declared = kind.interface.params
        values: dict[str, Any] = {}
        units: dict[str, OpenUnits] = {}
        whole = flat.path not in self.expansion.broken
        for name, node in flat.parameters.items():
            if name not in declared:
                is_setting = name not in flat.spec.parameters
                remedy = remedy_for(name, flat.parameters, declared, replaces=is_setting)
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
        required = [name for name, param in declared.items() if param.required]
        whole &= all(name in flat.parameters for name in required)
        given = flat.spec.parameters | flat.parameters
        for name in absent(required, given, declared) if "with" not in flat.spec.told else ():
            wanted = "a path" if declared[name].is_file else declared[name].wanted()
            self.faults.add(flat.spec.place, f"parameter '{name}' is missing", f"give {wanted} under 'with'")
        period = task.period if task is not None and self.step is not NO_STEP else None
        block = self._construct(flat, kind, values, period) if whole else None
        for doubt in block.doubts() if block is not None and period is not None else ():
            self.faults.warn(self._place(flat, doubt), str(doubt))
        return block or kind, units

    def _accepts(self, param: Param, value: Any, flat: FlatBlock) -> bool:
        try:
            param.accept(value)
        except ParameterError as error:
            self.faults.add(flat.parameters[param.name].place, str(error))
            return False
        return True

    def _construct(
        self, flat: FlatBlock, kind: type[Block], values: Mapping[str, Any], period: Fraction | None
    ) -> Block | None:
        """Make the block, which checks its parameters against each other, its files and its period."""
        key = (flat.path, kind, repr(sorted(values.items())), period)
        try:
            if key not in self.made:
                block = kind(**values)
                if period is not None:
                    block.period = float(period)
                    block.check_period()
                self.made[key] = block
            return self.made[key]
        except ParameterError as error:
            self.faults.add(self._place(flat, error), str(error))
        except DiagramError as error:
            for fault in error.faults:
                self.faults.append(self._from_file(fault, flat, values))
        except QuadvisError as error:
            self.faults.add(flat.spec.place, str(error))
        return None

    @staticmethod
    def _place(flat: FlatBlock, error: ParameterError) -> Place:
        node = flat.parameters.get(error.parameter)
        return node.place if node is not None else flat.spec.place

    def _from_file(self, fault: Fault, flat: FlatBlock, values: Mapping[str, Any]) -> Fault:
        """Return a fault of a file that a parameter names; one of the whole file is put where it is named."""
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
