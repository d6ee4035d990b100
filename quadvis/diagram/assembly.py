"""From the contents of files to a checked diagram: all checks in their order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType

from quadvis.block import Out
from quadvis.diagram.ages import read_routes
from quadvis.diagram.build import Builder, Made
from quadvis.diagram.check import WireCheck
from quadvis.diagram.conditions import Conditions
from quadvis.diagram.devices import check_devices, check_losses
from quadvis.diagram.diagram import Diagram
from quadvis.diagram.doubts import warn_jumps, warn_network, warn_parameters, warn_rates
from quadvis.diagram.draft import Draft
from quadvis.diagram.expand import Expansion, Kept
from quadvis.diagram.flow import Cases
from quadvis.diagram.foreign_code import check_code
from quadvis.diagram.group_files import GroupFiles
from quadvis.diagram.keys import RUN_SECTIONS
from quadvis.diagram.knobs import find_knobs
from quadvis.diagram.loader import read_group, read_part
from quadvis.diagram.matrices import matrix_files
from quadvis.diagram.outputs import check_writers
from quadvis.diagram.parts import Parts
from quadvis.diagram.routing import Network
from quadvis.diagram.scope import FlatBlock
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.context import Context
from quadvis.diagram.sections.expect import EXPECT
from quadvis.diagram.sections.files import FILES, check_files
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.overload import OVERLOAD, warn_tasks
from quadvis.diagram.sections.seed import SEED
from quadvis.diagram.sections.solver import SOLVER
from quadvis.diagram.sections.stop_time import STOP_TIME
from quadvis.diagram.sections.tasking import TASKING
from quadvis.diagram.sections.variants import VARIANTS
from quadvis.diagram.settings import ParameterFile, Settings
from quadvis.diagram.slots import fill_slots, stand_ins
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.ticks import check_ticks
from quadvis.diagram.times import read_duration
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlScalar
from quadvis.errors import UNKNOWN, DiagramError, Faults, Place, Unknown, known, quoted
from quadvis.errors.caller import as_given
from quadvis.graph.graph import Graph
from quadvis.graph.names import wire_text
from quadvis.library.catalogue import Catalogue, OwnBlocks
from quadvis.links.endpoints import links_of


class Assembly:
    """Assembles diagrams from the contents of one file."""

    def __init__(
        self,
        spec: FileSpec | Unknown,
        faults: Faults,
        params: Sequence[ParameterFile] = (),
        own_blocks: OwnBlocks = True,
    ) -> None:
        if spec is UNKNOWN:
            raise DiagramError(faults)
        self.spec, self.faults = spec, faults
        self.catalogue = Catalogue(spec.path.parent, own_blocks)
        self.parts = Parts(read_part, faults)
        self.groups = GroupFiles(read_group, faults)
        self.kept: dict[str, list[Kept]] = {}
        self.made: dict[str, list[Made]] = {}
        self.cases: Cases = {}
        # What a picture of a diagram with faults is made of: its blocks, and the ports of parts.
        self.flat: dict[str, FlatBlock] = {}
        self.drafts: list[Draft] = []
        self.part_ports: dict[str, str] = {}
        self._warned = 0  # files whose unused parameters are reported
        self._params = [path for file in params for path in (file.path, *file.bases)]
        self._bases: dict[int, Wiring] = {}  # of the diagrams on which others stand, by identity

    def diagram(
        self,
        variant: str | None = None,
        settings: Settings = MappingProxyType({}),
        stop_time: str | float | None = None,
        seed: int | None = None,
    ) -> Diagram:
        """Return the diagram; it may run if there are no faults."""
        written, faults = self.spec, self.faults
        spec = fill_slots(written, variant, faults)
        expansion = Expansion(spec, self.catalogue, settings, self.parts, self.groups, faults, self.kept)
        spec = expansion.spec
        wiring = Wiring(expansion, faults)
        wiring.stand_ins = stand_ins(spec, self._outputs)
        Conditions(expansion, wiring, faults).add()
        wiring.check_ports(expansion.root)
        builder = Builder(spec, expansion, wiring, self.made, faults)
        drafts = builder.drafts()
        ports = {name: wire_text(source) for name, source in wiring.ports()}
        self.flat, self.drafts, self.part_ports = expansion.blocks, drafts, ports
        step = builder.step if known(builder.step) else None
        names = {*expansion.blocks, *expansion.root.children}
        network = Network(spec[COMPUTERS], spec[LINKS], expansion.root.params, names)
        with faults.about(EXPECT.key):
            routes = read_routes(spec.nodes.get(EXPECT.key), wiring, faults)
        nodes = WireCheck(drafts, faults, self.cases, network, routes, spec[TASKING]).run()
        graph = Graph(spec.name, nodes, spec[SOLVER].method, step, spec[TASKING], spec[SOLVER].tolerances)
        stop = _stop_time(spec, stop_time, faults)
        if known(builder.step):
            tasks = {draft.task for draft in drafts if known(draft.task)}
            check_ticks(spec, tasks, builder.step, stop, faults)
        files = [written, *self.parts.specs()]
        for file in files[self._warned :]:
            warn_parameters(file, faults)
        self._warned = len(files)
        warn_jumps(drafts, graph, faults)
        if not self.variants:
            self.warn_unused()
            warn_network(spec, graph, faults)
            if expansion.is_whole:
                own = [each.overload for each in spec[COMPUTERS].values() if known(each) and each.overload]
                for limits in (spec[OVERLOAD], *own):
                    warn_tasks(limits, graph, faults)
        whole = spec[STOP_TIME]
        context = Context(
            wiring, graph, stop, isinstance(whole, Fraction) and stop < whole, faults,
            frozenset(spec[LINKS]),
        )  # fmt: skip
        for section in RUN_SECTIONS:
            with faults.about(section.key):
                context.values[section] = section.read(spec.nodes.get(section.key), context)
        check_files(spec[FILES], faults)
        seed = spec[SEED] if seed is None else _seed(seed, faults)
        listing = (*(draft.path for draft in drafts), *(link.name for link in links_of(graph)))
        matrices = map(Path, matrix_files())
        sources = (*spec.paths, *self.parts.files, *self.groups.files, *self._params, *matrices)
        check_writers(drafts, sources, faults)
        check_devices(drafts, faults)
        check_losses(spec[COMPUTERS], drafts, faults)
        check_code(drafts, self.catalogue.own_blocks, faults)
        entries = {name: wire_text(source) for name, source in wiring.entries()}
        return Diagram(
            spec.name, spec.path, variant, graph, stop, seed, spec.values | context.values, listing,
            self.variants, ports=MappingProxyType(ports), entries=MappingProxyType(entries), sources=sources,
            knobs=MappingProxyType(find_knobs(expansion)),
        )  # fmt: skip

    @property
    def variants(self) -> tuple[str, ...]:
        """The names of the diagram's variants."""
        return tuple(self.spec[VARIANTS])

    def warn_unused(self) -> None:
        """Warn of rates and of parameters of groups that nothing uses.

        Each variant must have been made before, as it may use some.
        """
        warn_rates(self.spec, self.parts, self.faults)
        if not self.faults:
            self.groups.warn_unused()

    def _outputs(self, spec: FileSpec, name: str) -> Mapping[str, Out]:
        """Return the outputs of a block of a diagram on which others stand, as far as they are right."""
        if id(spec) not in self._bases:
            expansion = Expansion(spec, self.catalogue, {}, self.parts, self.groups, Faults(), self.kept)
            self._bases[id(spec)] = Wiring(expansion, Faults())
        return self._bases[id(spec)].outputs(name)


def _stop_time(spec: FileSpec, given: str | float | None, faults: Faults) -> Fraction:
    name = as_given("--stop-time", "stop_time")
    if given is not None:
        text = given if isinstance(given, str) else f"{float(given)!r} s"
        return faults.collect(read_duration, YamlScalar(text, False, name, 0, 0)) or Fraction(0)
    written = spec[STOP_TIME]
    if written is None:
        faults.add(spec.top, "key 'stop_time' is missing", f"add 'stop_time: 10 s', or give {name}")
        return Fraction(0)
    return written if isinstance(written, Fraction) else Fraction(0)


def _seed(seed: int, faults: Faults) -> int:
    if not -(2**63) <= seed < 2**63:
        place, problem = Place(as_given("--seed", "seed")), f"the seed {quoted(seed)} does not fit 64 bits"
        faults.add(place, problem, "give a smaller one")
    return seed
