"""Warnings: diagrams that run, but are surely not what was meant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from quadvis.diagram.draft import Draft
from quadvis.diagram.parameters import named_parameters
from quadvis.diagram.parts import Parts
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.variants import VARIANTS
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.timing import timing_nodes
from quadvis.errors import Faults, known
from quadvis.graph.graph import VARIABLE, Graph
from quadvis.links.endpoints import links_of


def _blocks(spec: FileSpec) -> Iterator[BlockSpec]:
    """Yield the entries of all blocks of a file and of its variants."""
    for blocks in (spec[BLOCKS], *(variant.slots for variant in spec[VARIANTS].values())):
        yield from (block for block in blocks.values() if known(block))


def warn_parameters(spec: FileSpec, faults: Faults) -> None:
    """Warn of parameters of a file that neither a block there uses nor what it says of a run.

    Those of its base are not its own.
    """
    params = (node for node in spec[PARAMS].values() if known(node))
    nodes = (*spec.nodes.values(), *timing_nodes(spec), *params)
    used: set[str] = {name for node in nodes for name in named_parameters(node)}
    for block in _blocks(spec):
        parameters = block.parameters if known(block.parameters) else {}
        for node in (*parameters.values(), *block.groups, *block.constants):
            used |= named_parameters(node)
    for link in spec[LINKS].values():
        for node in link.fields.values() if known(link) else ():
            used |= named_parameters(node)
    for variant in spec[VARIANTS].values():
        for node in variant.nodes.values():
            used |= named_parameters(node)
    for name, value in spec[PARAMS].items():
        if name not in used and known(value) and value.file == spec.place.file:
            faults.warn(value.place, f"parameter '{name}' is not used", f"write '${name}' where it belongs")


def warn_network(spec: FileSpec, graph: Graph, faults: Faults) -> None:
    """Warn of links that carry nothing, and of computers on which no block runs."""
    if faults:
        return  # what is wrong may use any of them
    carrying, used = {link.name for link in links_of(graph)}, {node.computer for node in graph.nodes}
    for name, link in spec[LINKS].items():
        if known(link) and name not in carrying:
            ends = f"from '{link.source[0]}' to '{link.target[0]}'"
            faults.warn(
                link.place, f"link '{name}' carries nothing", f"leave it out, or wire something {ends}"
            )
    for name, computer in spec[COMPUTERS].items():
        if known(computer) and name not in used:
            remedy = f"leave it out, or write 'at: {name}' in a block"
            faults.warn(computer.place, f"no block runs on the computer '{name}'", remedy)


def warn_jumps(drafts: Sequence[Draft], graph: Graph, faults: Faults) -> None:
    """Warn of blocks on loops of the solver whose jumps are not located between two ticks."""
    if faults:
        return  # the graph lacks what is wrong
    places = {draft.path: draft.place for draft in drafts}
    located = graph.solver not in VARIABLE
    for node in graph.nodes:
        events = bool(node.block.interface.events)
        jumps = "" if events else node.block.jumps
        if not node.task.continuous or not (jumps or (events and not located)) or node.path not in places:
            continue
        if not _is_integrated_loop(graph, node.path):
            continue
        problem = f"'{node.kind}' jumps on a loop that the solver integrates, and the instant is not located"
        other = f"{jumps!r}, or " if isinstance(jumps, str) else ""
        remedy = f"take {other}a small step, and look at 'quadvis check --accuracy'"
        if events:
            problem = f"{graph.solver} sees the events of '{node.kind}' at ticks only"
            remedy = "choose ode1 to ode4, which locate them"
        with faults.about(f"block '{node.path}'"):
            faults.warn(places[node.path], problem, remedy)


def _is_integrated_loop(graph: Graph, path: str) -> bool:
    """Return whether a way through blocks of the continuous task leads from a block back to itself."""
    waiting, seen = [path], set[str]()
    while waiting:
        for _, wire in graph[waiting.pop()].wires():
            if wire.block == path:
                return True
            if wire.block not in seen and wire.block in graph and graph[wire.block].task.continuous:
                seen.add(wire.block)
                waiting.append(wire.block)
    return False


def warn_rates(spec: FileSpec, parts: Parts, faults: Faults) -> None:
    """Warn of rates at which no block of a diagram runs; `parts` has read those of all its variants."""
    if not parts.is_whole:
        return  # an unreadable value may use any of them
    rates = (block.rate for file in (spec, *parts.specs()) for block in _blocks(file))
    used = {rate[0] for rate in rates if rate is not None and known(rate)}
    for name, rate in spec[RATES].items():
        if known(rate) and name not in used and rate.place.file == spec.place.file:
            faults.warn(
                rate.place, f"no block runs at the rate '{name}'", "leave it out, or give it to a block"
            )
