"""A diagram: loaded, checked, and ready to run. This is where all faults of its files come together."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from quadvis.block import Block
from quadvis.diagram.build import Builder, Made
from quadvis.diagram.check import WireCheck, rate_text
from quadvis.diagram.doubts import warn, warn_rates
from quadvis.diagram.expand import Expansion, Parts
from quadvis.diagram.loader import FileSpec, read_file, read_text
from quadvis.diagram.observe import Observation, read_observation
from quadvis.diagram.outputs import check_writers
from quadvis.diagram.questions import QuestionReader, Questions
from quadvis.diagram.settings import Files, Given, ParameterFile, Settings, read_settings, setting_texts
from quadvis.diagram.slots import Outputs, check_slots, fill_slots
from quadvis.diagram.ticks import check_ticks
from quadvis.diagram.times import read_duration
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlScalar
from quadvis.engine.graph import Graph, Wire
from quadvis.engine.names import wire_text
from quadvis.errors import DiagramError, Doubt, Fault, Faults, Place, quoted
from quadvis.errors.discretion import quoting_only
from quadvis.library.catalogue import Catalogue, OwnBlocks
from quadvis.machine.files import reading
from quadvis.machine.inputs import noted_inputs

if TYPE_CHECKING:
    from quadvis.analysis.analyse import Analysis
    from quadvis.output.verdict import Entry, Judging, Outcome, Signals
    from quadvis.run.session import Progress, Result


@dataclass(frozen=True)
class Diagram:
    """A diagram without a fault: ``graph`` is what the engine runs, ``observation`` what is made of it."""

    name: str
    path: Path
    variant: str | None
    graph: Graph
    stop_time: Fraction
    seed: int
    observation: Observation
    listing: tuple[str, ...]  # the blocks in the order of the files
    questions: Questions
    variants: tuple[str, ...]
    parameter_files: tuple[ParameterFile, ...] = ()
    settings: tuple[str, ...] = ()  # the parameters that were replaced, block.parameter=value
    warnings: tuple[Doubt, ...] = ()  # what can be run, and is surely not what was meant
    ports: Mapping[str, str] = field(default_factory=dict)  # of parts: the signals of blocks that they are
    sources: tuple[Path, ...] = ()  # the YAML files of the diagram, its parts and its parameter files
    files: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of every file that was read, by path
    own_blocks: bool = True  # whether code beside the diagram may be run

    @cached_property
    def inputs(self) -> tuple[Path, ...]:
        """Every file that a run depends on; none of them may be written over."""
        from quadvis.diagram.outputs import files_read

        return tuple(files_read(self._blocks, self.sources))

    @property
    def _blocks(self) -> list[Block]:
        return [node.block for node in self.graph.nodes]

    @contextmanager
    def guarded(self, log: str | Path | None = None) -> Iterator[None]:
        """Keep the inputs from what is written meanwhile; QuadvisError if a block writes the log's file."""
        from quadvis.diagram.outputs import check_log

        if log is not None:
            check_log(log, self._blocks)
        with reading(self.inputs):
            yield

    @cached_property
    def resolved(self) -> str:
        """The diagram written out: parts expanded, variant and settings applied, every parameter given."""
        from quadvis.diagram.resolve import resolved_text

        return resolved_text(
            self.graph, self.stop_time, self.seed, self.observation, self.path.parent, self.files
        )

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved diagram: two runs with one hash and one seed are the same to the bit.

        On one kind of processor, with one set of versions: BLAS, OpenCV and the C library choose their code
        by the processor, and may round the last digit otherwise.
        """
        from hashlib import sha256

        return sha256(self.resolved.encode()).hexdigest()

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

    def judging(self) -> Judging:
        """Return what judges a run while it goes on."""
        return self.observation.judging()

    def judge(self, signals: Signals) -> Outcome:
        """Return the summary and the verdicts of a recorded run; it may have ended early."""
        return self.observation.judge(signals)

    def run(
        self,
        *,
        log: str | Path | None = None,
        progress: Progress | None = None,
        keep: Sequence[str] | None = None,
    ) -> Result:
        """Run to the stop time; see ``quadvis.run.session.run``."""
        from quadvis.run.session import run

        return run(self, log=log, progress=progress, keep=keep)

    def analyse(
        self,
        *,
        cuts: Mapping[str, str | Sequence[str]] = MappingProxyType({}),
        limits: Mapping[str, tuple[str, str, str]] = MappingProxyType({}),
        at: float | None = None,
    ) -> Analysis:
        """Linearise the closed loop at its operating point; see ``quadvis.analysis.analyse.analyse``."""
        from quadvis.analysis.analyse import analyse

        return analyse(self, cuts, limits, at)

    def varied(self, setting: str) -> Diagram:
        """Return the diagram, loaded again with one more parameter replaced: ``block.parameter=value``."""
        params, settings = [file.path for file in self.parameter_files], (*self.settings, setting)
        return load(
            self.path, variant=self.variant, settings=settings, params=params, seed=self.seed,
            own_blocks=self.own_blocks,
        )  # fmt: skip

    def draw(self) -> str:
        """Return a picture of the diagram as SVG."""
        from quadvis.diagram.resolve import constant_text
        from quadvis.output.draw import DrawnBlock, DrawnWire, draw

        nodes = [self.graph[path] for path in self.listing]
        blocks, wires, constants = [], [], {}
        for node in nodes:
            interface = node.block.interface
            shown = [port for port in interface.inputs if self._is_drawn(node, port)]
            blocks.append(
                DrawnBlock(node.path, node.kind, tuple(shown), tuple(interface.outputs), node.task.name)
            )
            for port in shown:
                source = node.inputs[port]
                if isinstance(source, Wire):
                    wires.append(DrawnWire(wire_text(source), node.path, port, source.crossing))
                else:
                    constants[node.path, port] = constant_text(node, port, source.value)
        tasks = {task.name: rate_text(task) for task in self.graph.tasks}
        return draw(self.name, blocks, wires, constants, tasks)

    def _is_drawn(self, node: Any, port: str) -> bool:
        source = node.inputs[port]
        return isinstance(source, Wire) or source.value is not node.block.interface.inputs[port].default


def load(
    path: str | Path,
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    stop_time: str | float | None = None,
    seed: int | None = None,
    own_blocks: OwnBlocks = True,
) -> Diagram:
    """Load and check a diagram; DiagramError tells all its faults at once.

    ``settings`` replace parameters: ``{"control/roll.bandwidth": "2.5 rad/s"}``, or texts
    ``control/roll.bandwidth=2.5 rad/s``; a name without a dot is a parameter of the diagram. ``params`` are
    parameter files, which hold such settings; they apply in their order, before ``settings``. ``stop_time``
    (s, or a text such as "20 s") and ``seed`` replace the diagram's.

    Loading runs the Python code of the blocks in the folder ``blocks`` beside the diagram.
    ``own_blocks=False`` refuses those; a function is called with that folder before the first of them is run.
    """
    faults = Faults()
    texts = setting_texts(settings)
    with quoting_only(_quotable(path, params, texts)), _told_once(faults) as digests:
        given, files = read_settings(settings, params, faults)
        spec = read_file(Path(path), faults, part=False)
        diagram = _Assembly(spec, faults, files, own_blocks).diagram(variant, given, stop_time, seed)
        found = tuple(sorted(set(faults.warnings)))
        return replace(
            diagram, parameter_files=files, settings=texts, warnings=found, files=digests,
            own_blocks=bool(own_blocks),
        )  # fmt: skip


def load_text(
    text: str, folder: str | Path = ".", name: str = "diagram.yaml", own_blocks: OwnBlocks = True
) -> Diagram:
    """Load a diagram from a text, such as the resolved one in a log, as if it stood in a file of a folder."""
    faults = Faults()
    with quoting_only([folder]), _told_once(faults) as digests:
        spec = read_text(text, Path(folder) / name, faults)
        diagram = _Assembly(spec, faults, own_blocks=own_blocks).diagram()
        return replace(diagram, files=digests)


def check(
    path: str | Path, settings: Given = (), params: Files = (), own_blocks: OwnBlocks = True
) -> Diagram:
    """Load a diagram, and with each of its variants in turn; DiagramError tells the faults of all of them."""
    faults = Faults()
    quotable = _quotable(path, params, setting_texts(settings))
    with quoting_only(quotable), _told_once(faults) as digests:
        given, files = read_settings(settings, params, faults)
        spec = read_file(Path(path), faults, part=False)
        assembly = _Assembly(spec, faults, files, own_blocks)
        diagram = assembly.diagram(settings=given)
        for variant in assembly.spec.variants:
            assembly.diagram(variant)
        assembly.warn_rates()
        return replace(diagram, warnings=tuple(sorted(set(faults.warnings))), files=digests)


def _quotable(path: str | Path, params: Files, settings: Sequence[str]) -> Iterator[str | Path]:
    """Yield the files and folders that faults may quote: the diagram's, and what its user named."""
    for file in (path, *([params] if isinstance(params, str | os.PathLike) else params)):
        yield Path(file).parent
        yield Path(os.path.realpath(file)).parent
    yield from (setting.partition("=")[2].strip() or "." for setting in settings)


@contextmanager
def _told_once(faults: Faults) -> Iterator[Mapping[str, str]]:
    """Raise what was found, and give the SHA-256 of every file that is read meanwhile, by path.

    One cause may be met from several blocks: its place and problem are the same.
    """
    try:
        with noted_inputs() as digests:
            yield digests
        faults.check()
    except DiagramError as error:
        kept: dict[tuple[Place, str, str], Fault] = {}
        for fault in error.faults:
            subject = "" if fault.place.line or fault.place.column else fault.subject
            kept.setdefault((fault.place, fault.problem, subject), fault)
        raise DiagramError(kept.values()) from None


class _Assembly:
    """Puts diagrams together out of what one file says."""

    def __init__(
        self,
        spec: FileSpec | None,
        faults: Faults,
        params: Sequence[ParameterFile] = (),
        own_blocks: OwnBlocks = True,
    ) -> None:
        if spec is None:
            raise DiagramError(faults)
        self.spec, self.faults = spec, faults
        self.catalogue = Catalogue(spec.path.parent, own_blocks)
        self.parts = Parts(faults)
        self.made: Made = {}
        self._params = [path for file in params for path in (file.path, *file.bases)]
        self._base: Wiring | None = None  # of the diagram without a variant

    def diagram(
        self,
        variant: str | None = None,
        settings: Settings = MappingProxyType({}),
        stop_time: str | float | None = None,
        seed: int | None = None,
    ) -> Diagram:
        """Return the diagram; it may run if there are no faults."""
        spec, faults = self.spec, self.faults
        filled = fill_slots(spec, variant, faults)
        expansion = Expansion(filled, self.catalogue, settings, self.parts, faults)
        wiring = Wiring(expansion, faults)
        promised = self._promised(filled)
        given = {slot: wiring.outputs(slot) for slot in promised if slot not in expansion.unknown}
        wiring.refused = check_slots(spec, filled, promised, given, faults)
        wiring.check_ports(expansion.root)
        builder = Builder(spec, expansion, wiring, self.made, faults)
        drafts = builder.drafts()
        graph = Graph(spec.name, WireCheck(drafts, faults).run(), spec.solver, builder.step)
        stop = _stop_time(spec, stop_time, faults)
        check_ticks(spec, graph, stop, faults)
        warn(spec, self.parts, stop, faults)
        if not spec.variants:
            self.warn_rates()
        shortened = spec.stop_time is not None and stop < spec.stop_time
        observation = read_observation(spec.sections, wiring, graph, stop, shortened, faults)
        nodes = {node.path: node for node in graph.nodes}
        questions = QuestionReader(wiring, graph, nodes).read(spec.sections.get("analyse"), faults)
        if spec.files:
            from quadvis.diagram.resolve import check_files

            check_files(spec, faults)
        seed = spec.seed if seed is None else _seed(seed, faults)
        listing = tuple(draft.path for draft in drafts)
        variants = tuple(spec.variants)
        sources = (spec.path, *self.parts.files, *self._params)
        check_writers(drafts, sources, faults)
        ports = {name: wire_text(source) for name, source in wiring.ports()}
        return Diagram(
            spec.name, spec.path, variant, graph, stop, seed, observation, listing, questions, variants,
            ports=MappingProxyType(ports), sources=sources,
        )  # fmt: skip

    def warn_rates(self) -> None:
        """Warn of rates that nothing uses; each variant must have been made before, as it may use some."""
        warn_rates(self.spec, self.parts, self.faults)

    def _promised(self, filled: FileSpec) -> Outputs:
        """Return the outputs of what stands in the slots that a variant fills."""
        spec = self.spec
        changed = [name for name, block in spec.blocks.items() if filled.blocks[name] is not block]
        if changed and self._base is None:
            self._base = Wiring(Expansion(spec, self.catalogue, {}, self.parts, Faults()), Faults())
        return {slot: self._base.outputs(slot) for slot in changed if self._base is not None}


def _stop_time(spec: FileSpec, given: str | float | None, faults: Faults) -> Fraction:
    if given is not None:
        text = given if isinstance(given, str) else f"{float(given)!r} s"
        return faults.collect(read_duration, YamlScalar(text, False, "--stop-time", 0, 0)) or Fraction(0)
    if spec.stop_time is None:
        faults.add(spec.top, "key 'stop_time' is missing", "add 'stop_time: 10 s', or give --stop-time")
        return Fraction(0)
    return spec.stop_time


def _seed(seed: int, faults: Faults) -> int:
    if not -(2**63) <= seed < 2**63:
        faults.add(Place("--seed"), f"the seed {quoted(seed)} does not fit 64 bits", "give a smaller one")
    return seed
