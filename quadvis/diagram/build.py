"""From flat blocks to drafts: parameters read, rates known, blocks made, constants typed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from quadvis.block import Block, In, Param, ParameterError
from quadvis.diagram.draft import Connection, Draft, unconnected
from quadvis.diagram.expand import Expansion
from quadvis.diagram.names import absent, remedy_for
from quadvis.diagram.scope import FlatBlock
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.solver import SOLVER
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.times import time_text
from quadvis.diagram.values import OpenUnits, file_fault, read_parameter, read_value
from quadvis.diagram.wiring import OpenInput, Wiring
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import (
    UNKNOWN,
    DiagramError,
    Faults,
    Place,
    QuadvisError,
    Unknown,
    known,
    suggestion,
)
from quadvis.graph.graph import CONTINUOUS, Constant, Task, Wire, common_divisor


class Made(NamedTuple):
    """A block that was made without a fault: for the variants that have it, too."""

    kind: type[Block]
    parameters: Mapping[str, YamlNode | Unknown]
    period: Fraction | None
    block: Block
    units: dict[str, OpenUnits]


_ANY_STEP = Fraction(1, 100)  # the continuous task needs one; no check looks at it


class Builder:
    """Makes the blocks and reports their faults. ``step`` is the solver's step, if a solver is needed."""

    def __init__(
        self,
        spec: FileSpec,
        expansion: Expansion,
        wiring: Wiring,
        made: dict[str, list[Made]],
        faults: Faults,
    ) -> None:
        self.spec, self.expansion, self.wiring, self.made, self.faults = spec, expansion, wiring, made, faults
        self.tasks = {
            name: Task(name, rate.period, rate.offset) for name, rate in spec[RATES].items() if known(rate)
        }
        self.step = self._choose_step()
        step = self.step if self.step is not None and known(self.step) else _ANY_STEP
        self._right: dict[tuple[Param, str], tuple[Any, OpenUnits]] = {}  # texts that were right, as values
        self._continuous = Task(CONTINUOUS, step, continuous=True)

    def drafts(self) -> list[Draft]:
        """Return the blocks whose class is known."""
        found = []
        for flat in self.expansion.blocks.values():
            with self.faults.about(f"block '{flat.path}'"):
                draft = self._draft(flat)
            if known(draft):
                found.append(draft)
        self._refuse_common_streams(found)
        return found

    def _refuse_common_streams(self, drafts: list[Draft]) -> None:
        """Report blocks whose noise has one name: it would be the same noise."""
        first: dict[str, str] = {}
        for draft in drafts:
            if not draft.interface.streams:
                continue
            other = first.setdefault(draft.stream, draft.path)
            if other != draft.path:
                flat = self.expansion.blocks[draft.path]
                place = next((spec.stream[1] for spec in flat.around if spec.stream is not None), draft.place)
                problem = f"'{other}' has the stream '{draft.stream}', too: their noise would be the same"
                with self.faults.about(f"block '{draft.path}'"):
                    self.faults.add(place, problem, "give each a name of its own")

    def _draft(self, flat: FlatBlock) -> Draft | Unknown:
        if flat.kind is UNKNOWN:
            list(self.wiring.inputs(flat))  # its wires are looked at all the same
            return UNKNOWN
        task = self._task(flat, flat.kind)
        block, units = self._build(flat, flat.kind, task)
        connections = dict(self._connections(flat, flat.kind))
        return Draft(
            flat.path, flat.spec.place, flat.spec.kind, flat.kind, block, task, connections, flat.places,
            units, flat.parameters, flat.stream, flat.spec.inherits, self._computer(flat), flat.condition,
        )  # fmt: skip

    def _choose_step(self) -> Fraction | Unknown | None:
        """Take the solver's step if anything is continuous; every period must be a whole number of steps."""
        first = next(filter(self._is_continuous, self.expansion.blocks.values()), None)
        if first is None:
            return None
        step = self.spec[SOLVER].step
        if step is None:
            problem = f"block '{first.path}' is continuous and the solver has no step"
            self.faults.add(first.spec.place, problem, "add 'solver: {method: ode4, step: 5 ms}'")
            return UNKNOWN
        if step is UNKNOWN:
            return UNKNOWN
        rates = [flat.rate for flat in self.expansion.blocks.values()]
        used = {rate[0] for rate in rates if rate is not None and known(rate)}
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

    def _rate(self, flat: FlatBlock) -> tuple[str, Place] | Unknown | None:
        """Return the rate of a block, and where it is written: where there is no choice, 'continuous'."""
        if flat.rate is None and not self.spec[RATES] and self.spec[SOLVER].step is not None:
            return CONTINUOUS, flat.spec.place
        return flat.rate

    def _is_continuous(self, flat: FlatBlock) -> bool:
        rate = self._rate(flat)
        named = rate is not None and known(rate) and rate[0] == CONTINUOUS
        return named or (known(flat.kind) and bool(flat.kind.interface.continuous))

    def _task(self, flat: FlatBlock, kind: type[Block]) -> Task | Unknown:
        """Return the task of a block."""
        own = flat.spec.rate
        if kind.interface.continuous:
            if own is not None and known(own) and own[0] != CONTINUOUS:
                problem = f"{flat.spec.kind} has continuous states, rate '{own[0]}' cannot hold it"
                sampled = (
                    ", or choose a 'method' that samples it" if "method" in kind.interface.params else ""
                )
                remedy = "leave 'rate' out, or write 'continuous'"
                self.faults.add(own[1], problem, remedy + sampled)
            return self._continuous
        rate = self._rate(flat)
        if rate is None:
            names = [*self.spec[RATES], CONTINUOUS]
            choice = f"choose from {', '.join(names)}" if len(names) > 1 else "declare one under 'rates'"
            self.faults.add(list(flat.around)[-1].place, "key 'rate' is missing", choice)
            return UNKNOWN
        if not known(rate):
            return UNKNOWN
        name, place = rate
        if name == CONTINUOUS:
            return self._continuous
        if name not in self.spec[RATES]:
            remedy = suggestion(name, [*self.spec[RATES], CONTINUOUS]) if self.spec[RATES] else ""
            self.faults.add(place, f"there is no rate '{name}'", remedy or "declare it under 'rates'")
        return self.tasks.get(name, UNKNOWN)

    def _computer(self, flat: FlatBlock) -> str | Unknown:
        """Return the computer that runs a block; "" if the diagram has none."""
        computers = self.spec[COMPUTERS]
        if flat.at is None:
            if computers:
                place = list(flat.around)[-1].place
                self.faults.add(place, "key 'at' is missing", f"choose from {', '.join(computers)}")
            return UNKNOWN if computers else ""
        if flat.at is UNKNOWN:
            return UNKNOWN
        name, place = flat.at
        if name not in computers:
            remedy = suggestion(name, computers) if computers else ""
            self.faults.add(place, f"there is no computer '{name}'", remedy or "declare it under 'computers'")
            return UNKNOWN
        return name

    def _build(
        self, flat: FlatBlock, kind: type[Block], task: Task | Unknown
    ) -> tuple[Block | Unknown, dict[str, OpenUnits]]:
        period = task.period if known(task) and known(self.step) else None
        for made in self.made.get(flat.path, ()):
            if made[:3] == (kind, flat.parameters, period):
                return made.block, made.units
        declared = kind.interface.params
        values: dict[str, Any] = {}
        units: dict[str, OpenUnits] = {}
        whole = known(flat.spec.parameters)
        for name, node in flat.parameters.items():
            if name not in declared:
                is_setting = name not in flat.spec.parameter_places
                remedy = remedy_for(name, flat.parameters, declared, replaces=is_setting)
                if name in kind.interface.inputs:
                    remedy = "it is an input; write it under 'in'"
                self.faults.add(flat.place(name), f"{flat.spec.kind} has no parameter '{name}'", remedy)
                whole = False
                continue
            read = self._value(declared[name], node) if known(node) else UNKNOWN
            if not known(read):
                whole = False
                continue
            values[name] = read[0]
            if read[1]:
                units[name] = read[1]
        missing = [name for name in kind.interface.required if name not in flat.parameters]
        whole &= not missing
        for name in absent(missing, flat.parameters, declared) if known(flat.spec.parameters) else ():
            remedy = f"give {declared[name].wanted()} under 'with'"
            self.faults.add(flat.spec.place, f"parameter '{name}' is missing", remedy)
        block = self._construct(flat, kind, values, period) if whole else UNKNOWN
        if known(block):
            self.made.setdefault(flat.path, []).append(Made(kind, flat.parameters, period, block, units))
            for doubt in block.doubts() if period is not None else ():
                self.faults.warn(self._place(flat, doubt), str(doubt))
        return block, units

    def _value(self, param: Param, node: YamlNode) -> tuple[Any, OpenUnits] | Unknown:
        """Return a parameter's value and its open units; a text that was right once is not read again."""
        text = node.value if isinstance(node, YamlScalar) and not param.is_text else None
        if text is not None and (param, text) in self._right:
            return self._right[param, text]
        read = self.faults.read(read_parameter, param, node, self.spec.path)
        if known(read):
            try:
                param.accept(read[0])
            except ParameterError as error:
                self.faults.add(node.place, str(error))
                return UNKNOWN
            if text is not None:
                self._right[param, text] = read
        return read

    def _construct(
        self, flat: FlatBlock, kind: type[Block], values: Mapping[str, Any], period: Fraction | None
    ) -> Block | Unknown:
        """Make the block, which checks its parameters against each other, its files and its period."""
        try:
            return kind(period=math.nan if period is None else float(period), **values)
        except ParameterError as error:
            self.faults.add(self._place(flat, error), str(error))
        except DiagramError as error:
            for fault in error.faults:
                self.faults.append(file_fault(fault, flat.parameters, values, self.faults.subject))
        except QuadvisError as error:
            self.faults.add(flat.spec.place, str(error))
        return UNKNOWN

    @staticmethod
    def _place(flat: FlatBlock, error: ParameterError) -> Place:
        node = flat.parameters.get(error.parameter, UNKNOWN)
        return node.place if known(node) else flat.spec.place

    def _connections(self, flat: FlatBlock, kind: type[Block]) -> Iterator[tuple[str, Connection]]:
        if flat.spec.inputs is UNKNOWN:
            yield from ((port, Connection(flat.spec.place, UNKNOWN)) for port in kind.interface.inputs)
        for port, source in self.wiring.inputs(flat):
            declared = kind.interface.inputs.get(port)
            if isinstance(source.source, YamlNode) and declared is not None:
                read = self.faults.read(read_value, declared.signal, declared.units, source.source)
                if known(read):
                    yield port, Connection(source.place, Constant(read[0]), read[1])
                else:
                    yield port, Connection(source.place, UNKNOWN)
            elif isinstance(source.source, OpenInput) and declared is not None:
                if declared.default is None:
                    self._report_open(source.source, declared)
                    yield port, Connection(source.place, UNKNOWN)
            else:
                wire = source.source if isinstance(source.source, Wire) else UNKNOWN
                yield (
                    port,
                    Connection(
                        source.place, wire, across=source.across, over=source.over, initial=source.initial
                    ),
                )

    def _report_open(self, found: OpenInput, reader: In) -> None:
        """Report an input of a part, unless a misspelt one was meant to be it."""
        part = found.part
        assert part.instance is not None
        inputs, ports = part.instance.inputs or {}, part.spec[PORTS]
        wanted = [port for port in ports.inputs if port not in ports.defaults]
        if known(inputs) and found.port in absent(wanted, inputs, ports.inputs):
            self.faults.add(part.instance.place, *unconnected(found.port, reader), subject=part.subject)
