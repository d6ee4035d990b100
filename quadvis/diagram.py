"""A diagram: loaded, checked, and ready to run. This is where all faults of its files come together."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.block import Block, Out, ParameterError
from quadvis.catalogue import Catalogue, CatalogueError
from quadvis.check import Connection, Draft, WireCheck, rate_text
from quadvis.document import parse_yaml
from quadvis.nodes import Node, Scalar
from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError, suggestion
from quadvis.expand import Expansion, FlatBlock
from quadvis.graph import Constant, Graph, Task, Wire
from quadvis.loader import CONTINUOUS, SECOND, FileSpec, read_file
from quadvis.observe import Observation, read_observation
from quadvis.units import Unit
from quadvis.values import read_parameter, read_value

if TYPE_CHECKING:
    from quadvis.run import Progress, Result
    from quadvis.verdict import Entry, Outcome, Signals

COMMAND_LINE = "--set"
NO_STEP = Fraction(1, 100)  # stands in for a solver step whose absence has been told


@dataclass(frozen=True)
class Diagram:
    """A diagram without a fault. ``graph`` is what the engine runs, ``observation`` what is made of the run."""

    name: str
    path: Path
    variant: str | None
    graph: Graph
    stop_time: Fraction
    seed: int
    observation: Observation
    resolved: str = field(repr=False)

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved diagram: two runs with one hash and one seed are the same to the bit."""
        return hashlib.sha256(self.resolved.encode()).hexdigest()

    @property
    def duration(self) -> float:
        """Simulated time of a run (s)."""
        return float(self.stop_time)

    @property
    def ticks(self) -> int:
        """Number of ticks of a run, the one at the stop time included."""
        return int(self.stop_time / self.graph.tick) + 1

    @property
    def summary(self) -> Sequence[Entry]:
        """What the summary of a run shows."""
        return self.observation.summary

    def logs(self, path: str) -> bool:
        """Whether a block's outputs are logged."""
        return path in self.observation.logged

    def decimation(self, path: str) -> int:
        """Every how many rows of a block are logged."""
        return self.observation.every.get(self.graph[path].task.name, 1)

    def judge(self, signals: Signals) -> Outcome:
        """Return the summary and the verdicts of a run."""
        return self.observation.judge(signals)

    def run(self, *, log: str | Path | None = None, progress: Progress | None = None) -> Result:
        """Run to the stop time; see ``quadvis.run.run``."""
        from quadvis.run import run

        return run(self, log=log, progress=progress)

    def draw(self) -> str:
        """Return a picture of the diagram as SVG."""
        from quadvis.draw import DrawnBlock, DrawnWire, draw
        from quadvis.resolve import constant_text, wire_text

        nodes = self.graph.nodes
        blocks, wires, constants = [], [], {}
        for node in nodes:
            interface = node.block.interface
            shown = [port for port in interface.inputs if self._is_drawn(node, port)]
            blocks.append(DrawnBlock(node.path, node.kind, tuple(shown), tuple(interface.outputs), node.task.name))
            for port in shown:
                source = node.inputs[port]
                if isinstance(source, Wire):
                    wires.append(DrawnWire(wire_text(source), node.path, port, source.crossing))
                else:
                    constants[node.path, port] = constant_text(interface.inputs[port], source.value)
        tasks = {task.name: rate_text(task) for task in self.graph.tasks}
        return draw(self.name, blocks, wires, constants, tasks)

    def _is_drawn(self, node: Any, port: str) -> bool:
        source = node.inputs[port]
        return isinstance(source, Wire) or source.value is not node.block.interface.inputs[port].default


def load(
    path: str | Path,
    *,
    variant: str | None = None,
    settings: Mapping[str, Any] | Sequence[str] = (),
    stop_time: str | float | None = None,
    seed: int | None = None,
) -> Diagram:
    """Load and check a diagram; DiagramError tells all its faults at once.

    ``settings`` replace parameters: ``{"roll.bandwidth": "2.5 rad/s"}``, or texts ``roll.bandwidth=2.5 rad/s``; a name
    without a dot is a parameter of the diagram. ``stop_time`` (s, or a text such as "20 s") and ``seed`` replace
    the diagram's.
    """
    faults = Faults()
    given = _settings(settings, faults)
    spec = read_file(Path(path), faults, part=False)
    if spec is None:
        raise DiagramError(faults)
    expansion = Expansion(spec, given, variant, faults)
    builder = _Builder(spec, expansion, faults)
    drafts = builder.drafts()
    if variant is not None:
        _check_slots(spec, given, expansion, builder, faults)
    order = WireCheck(drafts, expansion.unknown, faults).run()
    graph = Graph(spec.name, order, spec.solver, builder.step)
    stop = _stop_time(spec, stop_time, faults)
    observation = read_observation(spec.sections, expansion, graph, faults)
    faults.check()
    from quadvis.resolve import resolved_text

    seed = spec.seed if seed is None else seed
    resolved = resolved_text(spec, graph, stop, seed, observation)
    return Diagram(spec.name, Path(path), variant, graph, stop, seed, observation, resolved)


def _settings(settings: Mapping[str, Any] | Sequence[str], faults: Faults) -> dict[str, dict[str, Node]]:
    """Return the replaced parameters by block path ("" for the diagram's own) and name."""
    if isinstance(settings, Mapping):
        settings = [f"{name}={_text(value)}" for name, value in settings.items()]
    found: dict[str, dict[str, Node]] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not text.strip():
            faults.add(Place(COMMAND_LINE), f"'{name}' has no value", "write block.parameter=value, such as roll.bandwidth='2 rad/s'")
            continue
        # A file named here is relative to the working directory, as on any command line: the folder of "--set".
        node = faults.collect(parse_yaml, text, COMMAND_LINE)
        path, _, parameter = name.strip().rpartition(".")
        if node is not None:
            found.setdefault(path, {})[parameter] = node
    return found


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    tolist = getattr(value, "tolist", None)
    return str(tolist() if tolist else value)


def _stop_time(spec: FileSpec, given: str | float | None, faults: Faults) -> Fraction:
    if given is not None:
        text = given if isinstance(given, str) else f"{given!r} s"
        node = Scalar(text, False, "--stop-time", 0, 0)
        value = faults.collect(node.exact, SECOND)
        if value is not None and value < 0:
            faults.add(node.place, "a time cannot be negative", "write one such as '20 s'")
        return value if value is not None else Fraction(0)
    if spec.stop_time is None:
        faults.add(spec.place, "key 'stop_time' is missing", "add 'stop_time: 10 s', or give --stop-time", subject="")
        return Fraction(0)
    return spec.stop_time


class _Builder:
    """Turns flat blocks into drafts: classes found, parameters read, rates known."""

    def __init__(self, spec: FileSpec, expansion: Expansion, faults: Faults) -> None:
        self.spec, self.expansion, self.faults = spec, expansion, faults
        self.catalogue = Catalogue(spec.path.parent)
        self.tasks = {name: Task(name, rate.period, rate.offset) for name, rate in spec.rates.items()}
        self.step: Fraction | None = None

    def drafts(self) -> list[Draft]:
        """Return the blocks whose own entries are right; the others are told and marked as unknown."""
        classes = {block.path: self._class(block) for block in self.expansion.blocks}
        self._choose_step(classes)
        found = []
        for flat in self.expansion.blocks:
            kind = classes[flat.path]
            with self.faults.about(f"block '{flat.path}'"):
                task = self._task(flat, kind) if kind is not None else None
                built = self._build(flat, kind) if kind is not None else None
                if kind is None or built is None:
                    self.expansion.unknown.add(flat.path)
                    # The inputs of a block that cannot be built may still be looked at.
                    for _ in self.expansion.inputs(flat):
                        pass
                    continue
                block, units = built
                connections = dict(self._connections(flat, kind))
                found.append(Draft(flat.path, flat.spec.place, flat.spec.kind, block, task, connections,
                                   param_units=units))  # fmt: skip
        return found

    def _class(self, flat: FlatBlock) -> type[Block] | None:
        with self.faults.about(f"block '{flat.path}'"):
            try:
                return self.catalogue.find(flat.spec.kind)
            except CatalogueError as error:
                self.faults.add(flat.spec.kind_place, error.problem, error.remedy)
                return None

    def _choose_step(self, classes: Mapping[str, type[Block] | None]) -> None:
        """Take the solver's step if anything is continuous; every period must then be a whole number of steps."""
        first = next((flat for flat in self.expansion.blocks if self._is_continuous(flat, classes[flat.path])), None)
        if first is None:
            return
        self.step = self.spec.step
        if self.step is None:
            problem = f"block '{first.path}' is continuous and the solver has no step"
            self.faults.add(first.spec.place, problem, "add 'solver: {method: ode4, step: 5 ms}'", subject="")
            self.step = NO_STEP
            return
        for name, rate in self.spec.rates.items():
            for what, time in (("period", rate.period), ("offset", rate.offset)):
                if (time / self.step).denominator != 1:
                    problem = (
                        f"rates '{name}' and 'continuous' are not commensurate: the {what} {float(time):g} s is "
                        f"not a whole number of solver steps of {float(self.step):g} s"
                    )
                    self.faults.add(rate.place, problem, "choose a step that divides it", subject="")

    @staticmethod
    def _is_continuous(flat: FlatBlock, kind: type[Block] | None) -> bool:
        named = flat.rate is not None and flat.rate[0] == CONTINUOUS
        return named or (kind is not None and bool(kind.interface.continuous))

    def _task(self, flat: FlatBlock, kind: type[Block]) -> Task | None:
        continuous = Task(CONTINUOUS, self.step or NO_STEP, continuous=True)
        own = flat.spec.rate
        if kind.interface.continuous:
            if own not in (None, CONTINUOUS) and flat.spec.rate_place is not None:
                self.faults.add(flat.spec.rate_place, f"{flat.spec.kind} has continuous states, rate '{own}' cannot hold it",
                                "leave 'rate' out, or write 'continuous'")  # fmt: skip
            return continuous
        names = [*self.tasks, CONTINUOUS]
        if flat.rate is None:
            self.faults.add(flat.spec.place, "key 'rate' is missing", f"choose from {', '.join(names)}")
            return None
        name, place = flat.rate
        if name == CONTINUOUS:
            return continuous
        if name not in self.tasks:
            if name not in self.spec.rates:
                remedy = suggestion(name, names) or "declare it under 'rates'"
                self.faults.add(place, f"there is no rate '{name}'", remedy)
            return None
        return self.tasks[name]

    def _build(self, flat: FlatBlock, kind: type[Block]) -> tuple[Block, dict[str, tuple[Unit, ...]]] | None:
        declared = kind.interface.params
        before = len(self.faults)
        values: dict[str, Any] = {}
        units: dict[str, tuple[Unit, ...]] = {}
        for name, node in flat.parameters.items():
            place = flat.spec.parameter_places.get(name, node.place)
            if name not in declared:
                remedy = suggestion(name, declared) or "it has none"
                self.faults.add(place, f"{flat.spec.kind} has no parameter '{name}'", remedy)
                continue
            read = self.faults.collect(read_parameter, declared[name], node)
            if read is None:
                continue
            try:
                declared[name].accept(read[0])
            except ParameterError as error:
                self.faults.add(node.place, str(error))
                continue
            values[name] = read[0]
            if read[1]:
                units[name] = read[1]
        for name, param in declared.items():
            if param.required and name not in flat.parameters and flat.path not in self.expansion.unknown:
                self.faults.add(flat.spec.place, f"parameter '{name}' is missing", f"give {param.wanted()} under 'with'")
        if len(self.faults) > before or flat.path in self.expansion.unknown:
            return None
        return self._construct(flat, kind, values, units)

    def _construct(
        self, flat: FlatBlock, kind: type[Block], values: dict[str, Any], units: dict[str, tuple[Unit, ...]]
    ) -> tuple[Block, dict[str, tuple[Unit, ...]]] | None:
        try:
            return kind(**values), units
        except ParameterError as error:
            node = flat.parameters.get(error.parameter)
            self.faults.add(node.place if node is not None else flat.spec.place, str(error))
        except DiagramError as error:
            for fault in error.faults:
                self.faults.append(Fault(fault.place, fault.subject or self.faults.subject, fault.problem, fault.remedy))
        except QuadvisError as error:
            self.faults.add(flat.spec.place, str(error))
        return None

    def _connections(self, flat: FlatBlock, kind: type[Block]) -> Iterator[tuple[str, Connection]]:
        for port, source in self.expansion.inputs(flat):
            declared = kind.interface.inputs.get(port)
            if declared is None or source.source is None:
                # What is wrong is told by the wire check, or has been told already.
                yield port, Connection(source.place, None, told=source.source is None)
            elif isinstance(source.source, Wire):
                yield port, Connection(source.place, source.source, across=source.across)
            else:
                read = self.faults.collect(read_value, declared.signal, declared.units, source.source)
                constant = None if read is None else Constant(read[0])
                units = read[1] if read is not None else ()
                yield port, Connection(source.place, constant, units, told=read is None)


def _check_slots(
    spec: FileSpec, settings: Mapping[str, Mapping[str, Node]], filled: Expansion, builder: _Builder, faults: Faults
) -> None:
    """Refuse a variant whose part in a slot lacks an output of the part that it replaces, or changes its kind."""
    base = Expansion(spec, settings, None, Faults())
    for name, block in spec.blocks.items():
        now = filled.root.spec.blocks[name]
        if now is block or now.kind == block.kind:
            continue
        before, after = _exports(base, name, builder), _exports(filled, name, builder)
        for port, wanted in before.items():
            offered = after.get(port)
            if after and offered is None:
                problem = f"'{now.kind}' has no output '{port}', which '{block.kind}' gives in this slot"
                faults.add(now.kind_place, problem, "choose a block with the same outputs", subject=f"block '{name}'")
            elif offered is not None and (offered.signal, offered.units) != (wanted.signal, wanted.units):
                problem = (
                    f"output '{port}' of '{now.kind}' is {offered.type} in {offered.unit}, that of '{block.kind}' is "
                    f"{wanted.type} in {wanted.unit}"
                )
                faults.add(now.kind_place, problem, "choose a block with the same outputs", subject=f"block '{name}'")


def _exports(expansion: Expansion, name: str, builder: _Builder) -> dict[str, Out]:
    """Return the outputs that a slot offers; none if its block or part is not right."""
    kinds = {flat.path: flat.spec.kind for flat in expansion.blocks}
    child = expansion.root.children.get(name)
    if child is None:
        try:
            return dict(builder.catalogue.find(kinds[name]).interface.outputs) if name in kinds else {}
        except CatalogueError:
            return {}
    found = {}
    for port, reference in child.spec.outputs.items():
        source = expansion.find(child, reference).source
        if isinstance(source, Wire) and source.block in kinds:
            try:
                outputs = builder.catalogue.find(kinds[source.block]).interface.outputs
            except CatalogueError:
                continue
            if source.port in outputs:
                found[port] = outputs[source.port]
    return found
