"""`links`: what carries wires from one computer to another, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from quadvis.diagram.entries import named_entries
from quadvis.diagram.parameters import substitute
from quadvis.diagram.sections.forms import CONSTANT, QUANTITY, TEXT, Schema, closed, map_of, ref
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_duration
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known
from quadvis.links.endpoints import links_of
from quadvis.links.link import CARRIERS, MEMORY, PICTURE, SERIAL, UDP, Link

ENDS = ("from", "to")
OF_CARRIER: Mapping[str, tuple[str, ...]] = {
    MEMORY: ("room",),
    SERIAL: ("baud", "port", "jitter", "loss", "flips"),
    UDP: ("address", "jitter", "loss"),
}
OWN_KEYS = ("baud", "port", "address", "jitter", "loss", "flips", "room")
LINK_KEYS = (*ENDS, "via", *OWN_KEYS)
FASTEST = 10**8  # baud


class LinkSpec(NamedTuple):
    """A link as it is written; the values may name parameters, so `link_values` reads them."""

    name: str
    place: Place
    source: tuple[str, Place]
    target: tuple[str, Place]
    via: str
    fields: Mapping[str, YamlNode]


Links = dict[str, LinkSpec | Unknown]


class LinksSection(FileSection[Links]):
    """The links of a diagram, by name."""

    key = "links"
    words = (
        "what carries wires from one computer to another: `name: {from, to, via: memory, serial or udp}`, "
        "with `baud`, `port`, `address`, `jitter`, `loss`, `flips`, `room`, see below"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Links:
        """Return the links in the order of the file."""
        found: Links = {}
        for name, value in named_entries(node, "link", faults):
            with faults.about(f"link '{name}'"):
                found[name] = _link(name, value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: links by name."""
        return map_of(ref("link"), "what carries wires from one computer to another")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of one link."""
        ports = closed(ENDS, dict.fromkeys(ENDS, TEXT), ENDS)
        return {"link": closed(LINK_KEYS, {
            "from": {**TEXT, "description": "the computer that sends"},
            "to": {**TEXT, "description": "the computer that receives"},
            "via": {"enum": list(CARRIERS), "description": "how the bytes travel; memory if left out"},
            "baud": {**CONSTANT, "description": "of a serial line"},
            "port": {"anyOf": [TEXT, ports], "description": "of a serial line; a pair of ptys if left out"},
            "address": {**TEXT, "description": "host:port where the receiver of UDP listens"},
            "jitter": {**QUANTITY, "description": "in a simulation, the most that a frame is late"},
            "loss": {**QUANTITY, "description": "in a simulation, the share of frames that are lost"},
            "flips": {**QUANTITY, "description": "in a simulation, the share of bits that are flipped"},
            "room": {"type": "array", "description": "height and width of the largest picture, in pixels"},
        }, ENDS)}  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return the links that carry something, with their values."""
        return {link.name: _written(link) for link in links_of(diagram.graph) if link.declared} or None


def _link(name: str, node: YamlNode, faults: Faults) -> LinkSpec | Unknown:
    fields = faults.collect(node.fields, ENDS, LINK_KEYS[2:], faults)
    if fields is None:
        return UNKNOWN
    ends = [(faults.collect(fields[key].text), fields[key].place) for key in ENDS if key in fields]
    via = (faults.collect(fields["via"].choice, CARRIERS) if "via" in fields else MEMORY) or ""
    for key in OWN_KEYS if via else ():
        if key in fields and key not in OF_CARRIER[via]:
            others = [other for other in CARRIERS if key in OF_CARRIER[other]]
            problem = f"'{key}' says nothing of a link via {via}"
            remedy = f"leave it out, or write {' or '.join(repr(f'via: {other}') for other in others)}"
            faults.add(fields.keys[key].place, problem, remedy)
    if via == SERIAL and "baud" not in fields:
        faults.add(node.place, "key 'baud' is missing", "add 'baud: 115200'")
        return UNKNOWN
    (source, source_place), (target, target_place) = ends if len(ends) == 2 else ((None, None), (None, None))
    if not via or source is None or target is None or source_place is None or target_place is None:
        return UNKNOWN
    own = {key: fields[key] for key in OWN_KEYS if key in fields}
    return LinkSpec(name, node.place, (source, source_place), (target, target_place), via, own)


def link_values(
    spec: LinkSpec, params: Mapping[str, YamlNode | Unknown], faults: Faults
) -> dict[str, Any] | Unknown:
    """Return what a link says of its carrier, as `Link` takes it; a parameter may stand for any value."""
    found: dict[str, Any] = {}
    for key, node in spec.fields.items():
        value = _substituted(node, params, faults)
        read = faults.read(_READERS[key], value) if known(value) else UNKNOWN
        if known(read):
            found["ports" if key == "port" else key] = read
    return found if len(found) == len(spec.fields) else UNKNOWN


def _substituted(
    node: YamlNode, params: Mapping[str, YamlNode | Unknown], faults: Faults
) -> YamlNode | Unknown:
    """Return a value with parameters replaced, also those of the two ports."""
    if not isinstance(node, YamlMap) or not set(node) <= {*ENDS}:
        return substitute(node, params, faults)
    found = {key: substitute(value, params, faults) for key, value in node.values.items()}
    whole = {key: value for key, value in found.items() if known(value)}
    if len(whole) < len(found):
        return UNKNOWN
    return YamlMap(node.keys, whole, node.file, node.line, node.column, node.key)


def _baud(node: YamlNode) -> int:
    baud = node.integer()
    if not 1 <= baud <= FASTEST:
        raise node.wrong(f"a whole number from 1 to {FASTEST}", "write one such as 115200")
    return baud


def _ports(node: YamlNode) -> tuple[str, str]:
    if isinstance(node, YamlMap):
        fields = node.fields(ENDS)
        return fields["from"].text(), fields["to"].text()
    return node.text(), node.text()


def _address(node: YamlNode) -> str:
    host, colon, port = node.text().rpartition(":")
    if not (host and colon and port.isdecimal() and 0 < int(port) < 1 << 16):
        raise node.wrong("an address and a port", "write such as 192.0.2.10:5005")
    return node.text()


def _jitter(node: YamlNode) -> float:
    return float(read_duration(node))


def _share(node: YamlNode) -> float:
    share = node.quantity()
    if not 0.0 <= share <= 1.0:
        raise node.wrong("a share from 0 to 1", "write such as 0.01 or 1 %")
    return share


def _room(node: YamlNode) -> tuple[int, int]:
    sizes = [item.integer() for item in node.items()]
    if len(sizes) != 2 or not all(1 <= size <= 1 << 14 for size in sizes):
        raise node.wrong("the height and width of a picture in pixels", "write such as [480, 640]")
    return sizes[0], sizes[1]


_READERS: Mapping[str, Any] = {
    "baud": _baud, "port": _ports, "address": _address, "jitter": _jitter, "loss": _share, "flips": _share,
    "room": _room,
}  # fmt: skip


def _written(link: Link) -> dict[str, Any]:
    """Return a link as a diagram writes it; what is left out is the default."""
    found: dict[str, Any] = {"from": link.source, "to": link.target, "via": link.via}
    found |= dict(_said(link))
    return found


def _said(link: Link) -> Iterable[tuple[str, Any]]:
    if link.baud:
        yield "baud", link.baud
    if any(link.ports):
        yield "port", dict(zip(ENDS, link.ports, strict=True))
    if link.address:
        yield "address", link.address
    if link.jitter:
        yield "jitter", f"{link.jitter!r} s"
    if link.loss:
        yield "loss", link.loss
    if link.flips:
        yield "flips", link.flips
    if link.room != PICTURE:
        yield "room", list(link.room)


LINKS = LinksSection()
