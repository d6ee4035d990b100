"""Warnings: diagrams that run, but are surely not what was meant."""

from __future__ import annotations

from collections.abc import Iterator

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
from quadvis.graph.graph import Graph
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
