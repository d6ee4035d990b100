"""A diagram without a fault, as data: the graph for the engine, and the sections for the results of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from quadvis.block import Block
from quadvis.diagram.keys import SECTIONS
from quadvis.diagram.knobs import Knob
from quadvis.diagram.loop_requirements import LoopRequirement
from quadvis.diagram.requirements import Entry, Expectation
from quadvis.diagram.sections.analyse import ANALYSE, Questions
from quadvis.diagram.sections.computers import COMPUTERS, ComputerSpec
from quadvis.diagram.sections.expect import EXPECT
from quadvis.diagram.sections.log import LOG
from quadvis.diagram.sections.on_host_loss import ON_HOST_LOSS
from quadvis.diagram.sections.overload import OVERLOAD, OverloadLimits
from quadvis.diagram.sections.section import Values
from quadvis.diagram.sections.summary import SUMMARY
from quadvis.diagram.settings import ParameterFile
from quadvis.document import dump_yaml
from quadvis.errors import Doubt, known
from quadvis.graph.graph import Graph
from quadvis.links.endpoints import links_of
from quadvis.links.link import Link
from quadvis.machine.files import reading


@dataclass(frozen=True)
class Diagram:
    """A diagram without a fault: ``graph`` is for the engine, ``values`` are the values of its sections."""

    name: str
    path: Path
    variant: str | None
    graph: Graph
    stop_time: Fraction
    seed: int
    values: Values
    listing: tuple[str, ...]  # the blocks in the order of the files
    variants: tuple[str, ...]
    parameter_files: tuple[ParameterFile, ...] = ()
    settings: tuple[str, ...] = ()  # the parameters that were replaced, block.parameter=value
    warnings: tuple[Doubt, ...] = ()  # faults that do not prevent a run
    ports: Mapping[str, str] = field(default_factory=dict)  # of parts: the signals of blocks that they are
    entries: Mapping[str, str] = field(default_factory=dict)  # inputs of parts: the signals that feed them
    sources: tuple[Path, ...] = ()  # the YAML files: its own, of bases, parts and parameter files
    files: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of every file that was read, by path
    knobs: Mapping[str, Knob] = field(default_factory=dict)  # parameters of its own and of parts
    own_blocks: bool = True  # whether code beside the diagram may be run
    here: tuple[str, ...] = ()  # the computers that a real-time run of this machine has; all of them if empty

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
        """Protect the inputs from outputs inside; QuadvisError if a block writes the log's file."""
        from quadvis.diagram.outputs import check_log

        if log is not None:
            check_log(log, self._blocks)
        with reading(self.inputs):
            yield

    @cached_property
    def resolved(self) -> str:
        """The diagram written out: parts expanded, variant and settings applied, every parameter given.

        It loads in the diagram's folder, and gives the same run to the bit.
        """
        written = {section.key: section.resolved(self) for section in SECTIONS}
        return dump_yaml({key: value for key, value in written.items() if value is not None})

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved diagram: two runs with one hash and one seed are the same to the bit.

        On one kind of processor, with one set of versions: OpenCV and the C library choose their code
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
    def expectations(self) -> Sequence[Expectation]:
        """The requirements on a run."""
        return self.values[EXPECT].items

    @property
    def loop_requirements(self) -> Sequence[LoopRequirement]:
        """The requirements on the loop, which an analysis judges and a run does not."""
        return self.values[EXPECT].loop

    @property
    def summary(self) -> Sequence[Entry]:
        """The lines of the summary of a run."""
        return self.values[SUMMARY].items

    @property
    def questions(self) -> Questions:
        """The questions for an analysis of the loop."""
        return self.values[ANALYSE]

    @property
    def overload(self) -> OverloadLimits:
        """How many overruns a real-time run may have."""
        return self.values[OVERLOAD]

    @property
    def links(self) -> Sequence[Link]:
        """What carries wires between its computers."""
        return links_of(self.graph)

    @property
    def computers(self) -> tuple[str, ...]:
        """The computers that a real-time run of this machine has."""
        return self.here or self.graph.computers

    @property
    def graph_here(self) -> Graph:
        """The graph without the blocks that run on other machines."""
        if not self.here:
            return self.graph
        return replace(self.graph, nodes=[node for node in self.graph.nodes if node.computer in self.here])

    @property
    def links_here(self) -> Sequence[Link]:
        """The links that have an end on this machine."""
        return [link for link in self.links if {link.source, link.target} & set(self.computers)]

    def computer(self, name: str) -> ComputerSpec | None:
        """Return what it says of one of its computers; None if it says nothing."""
        spec = self.values[COMPUTERS].get(name)
        return spec if spec is not None and known(spec) else None

    def overload_of(self, computer: str) -> OverloadLimits:
        """How many overruns the tasks of one computer may have."""
        spec = self.computer(computer)
        return self.overload if spec is None or spec.overload is None else spec.overload

    @property
    def on_host_loss(self) -> str:
        """What a real-time run does when the process is lost that has started it."""
        return self.values[ON_HOST_LOSS]

    def logs(self, path: str) -> bool:
        """Whether a block's outputs are logged."""
        return path in self.values[LOG].paths

    def decimation(self, path: str) -> int:
        """Every how many rows of a block are logged."""
        return self.values[LOG].every.get(self.graph[path].task.name, 1)
