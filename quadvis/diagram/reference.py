"""Names of signals where a diagram writes them."""

from __future__ import annotations

from dataclasses import dataclass

from quadvis.document import YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown
from quadvis.graph.graph import Index
from quadvis.graph.names import read_name


@dataclass
class Reference:
    """A signal as a file names it, with an index if there is one."""

    place: Place
    block: str
    port: str
    index: Index = ()


def read_reference(node: YamlNode, faults: Faults) -> Reference | Unknown:
    """Return the signal that a text names."""
    text = faults.collect(node.text)
    if text is None:
        return UNKNOWN
    named = read_name(text)
    if named is None:
        remedy = "write block.port, block.port[0] or part/block.port[0:2]"
        faults.add(node.place, f"'{text}' is not a signal", remedy)
        return UNKNOWN
    return Reference(node.place, named.block, named.port, named.index)
