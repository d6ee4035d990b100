"""Wires between computers: each finds its link, and every link its message; all faults are collected."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from quadvis.diagram.draft import Draft, DraftWire, Key
from quadvis.diagram.messages import message_of, report
from quadvis.diagram.sections.computers import Computers
from quadvis.diagram.sections.links import Links, LinkSpec, link_values
from quadvis.diagram.times import rate_text
from quadvis.document import YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import DELAY, Node, Task
from quadvis.links.insertion import fastest, insert
from quadvis.links.link import MEMORY, Link
from quadvis.links.message import FRAME
from quadvis.units import Unit

ONE = Unit()
Ends = tuple[str, str]  # the computers that send and receive


class Network(NamedTuple):
    """The computers and links of a diagram, its parameters, and the names of its blocks and parts."""

    computers: Computers
    links: Links
    params: Mapping[str, YamlNode | Unknown]
    blocks: Collection[str]


class Hop(NamedTuple):
    """A wire between two computers: its ends, the task of its producer, and whether it carries a picture."""

    wire: DraftWire
    ends: Ends
    task: Task
    is_picture: bool


def crosses(drafts: Mapping[str, Draft], wire: DraftWire) -> bool:
    """Say whether a wire leads from one computer to another."""
    source, target = drafts[wire.wire.block].computer, wire.draft.computer
    return known(source) and known(target) and source != target


class Routing:
    """Puts the wires between computers on links."""

    def __init__(
        self, drafts: Mapping[str, Draft], nodes: dict[str, Node], network: Network, faults: Faults
    ) -> None:
        self.drafts, self.nodes, self.network, self.faults = drafts, nodes, network, faults
        self._specs: dict[str, LinkSpec] = {}

    def run(
        self,
        wires: Sequence[DraftWire],
        whole: Collection[Key],
        shadows: Mapping[Key, Sequence[DraftWire]] = MappingProxyType({}),
    ) -> None:
        """Put those wires of which all is known (``whole``) on links; the others lead nowhere.

        A wire between computers breaks a loop, whatever is wrong with it. ``shadows`` are further wires that
        go the way of others, by the keys of those.
        """
        self._check_specs()
        between = [wire for wire in wires if crosses(self.drafts, wire)]
        self._check_words(wires, {wire.connection.place for wire in between})
        hops = [self._hop(wire) for wire in between if wire.key in whole]
        chosen = self._chosen([hop for hop in hops if known(hop)])
        put = set()
        for name, named in chosen.items():
            beside = [hop._replace(wire=wire) for hop in named for wire in shadows.get(hop.wire.key, ())]
            mine = [*named, *(hop._replace(is_picture=False) for hop in beside)]
            link = self._link(name, mine)
            if known(link):
                keys = [hop.wire.key for hop in mine]
                insert(self.nodes, link, keys)
                put.update(keys)
        for wire in between:
            for each in (wire, *shadows.get(wire.key, ())):
                if each.key not in put:
                    self.nodes[each.draft.path].inputs.pop(each.port, None)

    def _check_specs(self) -> None:
        computers = self.network.computers
        for name, spec in self.network.links.items():
            if not known(spec):
                continue
            with self.faults.about(f"link '{name}'"):
                right = True
                for end, place in (spec.source, spec.target):
                    if end not in computers:
                        remedy = suggestion(end, computers) or "declare it under 'computers'"
                        self.faults.add(place, f"there is no computer '{end}'", remedy)
                        right = False
                if right and spec.source[0] == spec.target[0]:
                    problem = f"both ends are on '{spec.target[0]}'"
                    self.faults.add(spec.target[1], problem, "a link leads from one computer to another")
                    right = False
                if name in self.network.blocks:
                    self.faults.add(spec.place, f"a block is called '{name}', too", "choose another name")
                    right = False
            if right:
                self._specs[name] = spec

    def _check_words(self, wires: Iterable[DraftWire], crossing: set[Place]) -> None:
        """Report words for links on wires that lead from no computer to another, each once."""
        for wire in wires:
            connection, source = wire.connection, self.drafts[wire.wire.block]
            if connection.place in crossing or not (known(source.computer) and known(wire.draft.computer)):
                continue
            for word, node in (("over", connection.over), ("initial", connection.initial)):
                if node is not None and not self.faults.reported(node.place):
                    on = f"both blocks are on '{source.computer}'" if source.computer else "there are none"
                    problem = f"'{word}' is for a wire between computers, and {on}"
                    self._add(wire, node.place, problem, "leave it out")

    def _add(self, wire: DraftWire, place: Place, problem: str, remedy: str = "") -> None:
        report(self.faults, wire, place, problem, remedy)

    def _hop(self, wire: DraftWire) -> Hop | Unknown:
        source, target = self.drafts[wire.wire.block], wire.draft
        if wire.wire.crossing == DELAY:
            place = wire.connection.across
            place = place if isinstance(place, Place) else wire.connection.place
            problem = "'across: delay' is for two blocks on one computer"
            self._add(wire, place, problem, "leave it out: a link gives what came before this instant")
            return UNKNOWN
        if not known(source.task) or not known(target.task):
            return UNKNOWN
        assert known(source.computer) and known(target.computer)
        is_picture = wire.declared.signal.scalar == FRAME
        return Hop(wire, (source.computer, target.computer), source.task, is_picture)

    def _chosen(self, hops: Sequence[Hop]) -> dict[str, list[Hop]]:
        """Return the wires of each link: those that name it, then those for which one link is left."""
        found: dict[str, list[Hop]] = {}
        rest: dict[tuple[Ends, Task], list[Hop]] = {}
        for hop in hops:
            if hop.wire.connection.over is not None:
                spec = self._named(hop, hop.wire.connection.over)
                if known(spec):
                    found.setdefault(spec.name, []).append(hop)
            else:
                rest.setdefault((hop.ends, hop.task), []).append(hop)
        self._check_rates(found)
        for (ends, task), mine in sorted(rest.items(), key=lambda item: (item[0][0], item[0][1].name)):
            rivals = [hop for (both, _), hops in rest.items() if both == ends for hop in hops]
            for hop in mine:
                name = self._fitting(hop, found, rivals)
                if known(name):
                    found.setdefault(name or implicit_name(ends, task), []).append(hop)
        return found

    def _named(self, hop: Hop, node: YamlNode) -> LinkSpec | Unknown:
        """Return the link that a wire names."""
        name = self.faults.collect(node.text)
        if name is None:
            return UNKNOWN
        if name not in self.network.links:
            remedy = suggestion(name, self.network.links) or "declare it under 'links'"
            self._add(hop.wire, node.place, f"there is no link '{name}'", remedy)
            return UNKNOWN
        spec = self._specs.get(name)
        if spec is None:
            return UNKNOWN
        if (spec.source[0], spec.target[0]) != hop.ends:
            leads = f"link '{name}' leads from '{spec.source[0]}' to '{spec.target[0]}'"
            problem = f"{leads}, this wire from '{hop.ends[0]}' to '{hop.ends[1]}'"
            self._add(hop.wire, node.place, problem, "name another one, or leave 'over' out")
            return UNKNOWN
        if hop.is_picture and spec.via != MEMORY:
            problem = f"'{hop.wire.wire.source}' is a picture, and link '{name}' goes via {spec.via}"
            self._add(hop.wire, node.place, problem, "pictures travel on links 'via: memory'")
            return UNKNOWN
        return spec

    def _check_rates(self, found: dict[str, list[Hop]]) -> None:
        """Report wires of another rate than the first one of the same link, and leave them out."""
        for name, mine in found.items():
            task = min(mine, key=lambda hop: hop.wire.key).task
            for hop in mine:
                if hop.task != task:
                    carried = next(other for other in mine if other.task == task).wire.wire.source
                    node = hop.wire.connection.over
                    problem = (
                        f"link '{name}' carries '{carried}' ({rate_text(task)}), and "
                        f"'{hop.wire.wire.source}' is of another rate ({rate_text(hop.task)})"
                    )
                    assert node is not None
                    self._add(hop.wire, node.place, problem, "declare a link for each rate")
            found[name] = [hop for hop in mine if hop.task == task]

    def _fits(self, name: str, hop: Hop) -> bool:
        spec = self._specs[name]
        return (spec.source[0], spec.target[0]) == hop.ends and (spec.via == MEMORY or not hop.is_picture)

    def _fitting(self, hop: Hop, found: Mapping[str, Sequence[Hop]], rivals: Sequence[Hop]) -> str | Unknown:
        """Return the declared link for a wire that names none; "" if there is none for it.

        ``rivals`` are all wires between the same computers that name none.
        """
        fitting = [name for name in self._specs if self._fits(name, hop)]
        same = [name for name in fitting if name in found and found[name][0].task == hop.task]
        free = [name for name in fitting if name not in found]
        placed = {found[name][0].task for name in fitting if name in found}
        tasks = {rival.task for rival in rivals if free and self._fits(free[0], rival)} - placed
        if not same and len(tasks) > 1:
            rates = ", ".join(sorted(rate_text(task) for task in tasks))
            problem = f"link '{free[0]}' can carry signals of one rate, and there are several: {rates}"
            self._add(hop.wire, hop.wire.connection.place, problem, f"say which wires go 'over: {free[0]}'")
            return UNKNOWN
        names = same or free
        if len(names) > 1:
            both = " and ".join(f"'{name}'" for name in names)
            problem = f"links {both} both lead from '{hop.ends[0]}' to '{hop.ends[1]}'"
            choice = " or ".join(f"'over: {name}'" for name in names)
            self._add(hop.wire, hop.wire.connection.place, problem, f"write {choice}")
            return UNKNOWN
        return names[0] if names else ""

    def _link(self, name: str, hops: Sequence[Hop]) -> Link | Unknown:
        spec = self._specs.get(name)
        first = min(hops, key=lambda hop: hop.wire.key)
        if spec is None and (name in self.network.blocks or name in self.network.links):
            problem = f"the link that carries this would be called '{name}', as something else is"
            self._add(first.wire, first.wire.connection.place, problem, "declare a link for it under 'links'")
            return UNKNOWN
        values: dict[str, Any] | Unknown = {}
        if spec is not None:
            with self.faults.about(f"link '{name}'"):
                values = link_values(spec, self.network.params, self.faults)
        message = message_of([hop.wire for hop in hops], self.nodes, self.faults)
        if not known(values) or not known(message):
            return UNKNOWN
        reader = fastest(self.nodes[hop.wire.draft.path].task for hop in hops)
        link = Link(
            name, *first.ends, spec.via if spec else MEMORY, first.task.name, first.task.period,
            reader.period, message, declared=spec is not None, **values,
        )  # fmt: skip
        if spec is not None and link.share > 1.0:
            place = spec.fields["baud"].place
            least = math.ceil(link.baud * link.share)
            problem = f"{link.facts()}: the line cannot carry them"
            remedy = f"choose at least {least} baud, or carry less"
            self.faults.add(place, problem, remedy, subject=f"link '{name}'")
            return UNKNOWN
        return link


def implicit_name(ends: Ends, task: Task) -> str:
    """Return the name of the link in memory that carries wires for which none is declared."""
    return f"{ends[0]}_to_{ends[1]}_{task.name}"
