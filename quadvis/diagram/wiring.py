"""The meaning of every name of a signal: a wire from a block, through the ports of parts, or a constant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from typing import NamedTuple

from quadvis.block import Out, entry_name
from quadvis.diagram.expand import Expansion
from quadvis.diagram.parameters import substitute
from quadvis.diagram.reference import Reference
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.blocks import BLOCKS, INSIDE
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.slots import StandIn
from quadvis.document import YamlList, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import Index, Wire

MAX_PORTS = 50  # of parts, that a signal passes without meeting a block


class OpenInput(NamedTuple):
    """An input of a part that nothing feeds, so that its readers take their own defaults."""

    part: Scope
    port: str


class Source(NamedTuple):
    """The source of an input, and the place of the word for its crossing between rates.

    ``over`` is the link that carries it to another computer, ``initial`` its value there at first.
    """

    place: Place
    source: Wire | YamlNode | OpenInput | Unknown
    across: Place | Unknown | None = None
    over: YamlNode | None = None
    initial: YamlNode | None = None


class Wiring:
    """Finds the source of a name. ``stand_ins`` are the blocks in the place of others, by name."""

    def __init__(self, expansion: Expansion, faults: Faults) -> None:
        self.expansion, self.faults = expansion, faults
        self.stand_ins: Mapping[str, StandIn] = {}
        self._unfit: set[tuple[str, str]] = set()  # stand-ins and their outputs that are wrong
        # The ports of parts are resolved once, so that a fault in them is reported once.
        self._found: dict[tuple[str, str], Source] = {}
        self._sought: set[tuple[str, str]] = set()
        # Outputs of parts and of blocks that have a block to show them, by prefix and port.
        self.shown: Mapping[tuple[str, str], Wire] = {}

    @property
    def inner_blocks(self) -> Set[str]:
        """The blocks whose outputs are shown by others, as those inside of a part are."""
        return {prefix[:-1] for prefix, _ in self.shown} & self.expansion.blocks.keys()

    def check_ports(self, scope: Scope) -> None:
        """Resolve the ports of every part, used or not."""
        for child in scope.parts:
            for port in child.spec[PORTS].inputs:
                self._entry(child, port)
            for port in child.spec[PORTS].outputs:
                self.inner(child, port)
            self.check_ports(child)

    def ports(self, scope: Scope | None = None) -> Iterator[tuple[str, Wire]]:
        """Yield the outputs of every part, by full names such as "control/heading.right".

        Those of blocks that another block shows stand there, too.
        """
        if scope is None:
            inner = self.inner_blocks
            for (prefix, port), wire in self.shown.items():
                if prefix[:-1] in inner:
                    yield f"{prefix[:-1]}.{port}", wire
        scope = scope or self.expansion.root
        for child in scope.parts:
            for port in child.spec[PORTS].outputs:
                source = self._export(child, port).source
                if isinstance(source, Wire):
                    yield f"{child.prefix.removesuffix('/')}.{port}", source
            yield from self.ports(child)

    def entries(self, scope: Scope | None = None) -> Iterator[tuple[str, Wire]]:
        """Yield the inputs of every part that a signal feeds, by full names such as "control.position"."""
        scope = scope or self.expansion.root
        for child in scope.parts:
            for port in child.spec[PORTS].inputs:
                source = self._entry(child, port).source
                if isinstance(source, Wire):
                    yield f"{child.prefix.removesuffix('/')}.{port}", source
            yield from self.entries(child)

    def inputs(self, block: FlatBlock) -> Iterator[tuple[str, Source]]:
        """Yield the source of each input of a block."""
        yield from ((port, Source(block.spec.place, wire)) for port, wire in block.wires.items())
        inputs = block.spec.inputs or {}
        counts = block.kind.entry_counts if known(block.kind) else {}
        single = block.kind.interface.inputs if known(block.kind) else {}
        for port, given in inputs.items() if known(inputs) else ():
            if port in counts:
                for number, entry in enumerate(given.entries):
                    yield entry_name(port, number), self._source(block.scope, entry)
            elif isinstance(given.source, tuple) and port not in single:
                for entry in given.source:
                    self._source(block.scope, entry)
                yield port, Source(given.place, UNKNOWN)
            else:
                yield port, self._source(block.scope, given)

    def outputs(self, name: str) -> Mapping[str, Out]:
        """Return the outputs of one of the diagram's own blocks or parts, as far as they are right."""
        blocks, child = self.expansion.blocks, self.expansion.root.children.get(name)
        if child is None or child is UNKNOWN:
            kind = blocks[name].kind if name in blocks else UNKNOWN
            return kind.interface.outputs if known(kind) else {}
        found = {}
        for port in child.spec[PORTS].outputs:
            source = self._export(child, port).source
            kind = blocks[source.block].kind if isinstance(source, Wire) else UNKNOWN
            if isinstance(source, Wire) and known(kind):
                found[port] = kind.interface.outputs[source.port]
        return found

    def find(self, scope: Scope, reference: Reference) -> Source:
        """Return the source that a name means in a scope."""
        if reference.block == INSIDE:
            return self._indexed(self._inside(scope, reference), reference)
        owner, name = _owner(scope, reference.block)
        path = owner.prefix + name
        if not owner.knows(name):
            return Source(reference.place, UNKNOWN)
        if name not in owner.spec[BLOCKS]:
            way = reference.block.removesuffix(name)
            names = [way + other for other, block in owner.spec[BLOCKS].items() if known(block)]
            names += [INSIDE] if owner.spec[PORTS].inputs else []
            remedy = suggestion(reference.block, names)
            self.faults.add(reference.place, f"there is no block '{reference.block}'", remedy)
            return Source(reference.place, UNKNOWN)
        child = owner.children.get(name)
        if child is None or child is UNKNOWN:
            kind = self.expansion.blocks[path].kind
            if kind is UNKNOWN or not self._offers(path, reference, kind.interface.outputs):
                return Source(reference.place, UNKNOWN)
            shown = self.shown.get((f"{path}/", reference.port), Wire(path, reference.port))
            return Source(reference.place, replace(shown, index=reference.index))
        if not self._offers(path, reference, child.spec[PORTS].outputs):
            return Source(reference.place, UNKNOWN)
        return self._indexed(self._export(child, reference.port)._replace(place=reference.place), reference)

    def _offers(self, path: str, reference: Reference, outputs: Mapping[str, object]) -> bool:
        if path in self.stand_ins and not self._stands_in(path, reference):
            return False
        if reference.port not in outputs:
            remedy = suggestion(reference.port, outputs) if outputs else "it has none"
            problem = f"block '{reference.block}' has no output '{reference.port}'"
            self.faults.add(reference.place, problem, remedy)
        return reference.port in outputs

    def _stands_in(self, name: str, reference: Reference) -> bool:
        """Say whether a block in the place of another one gives an output that is read; report it once."""
        stand_in, port = self.stand_ins[name], reference.port
        if (name, port) in self._unfit:
            return False
        problem = stand_in.misfit(port, self.outputs(name).get(port), reference.place)
        if problem:
            remedy = "choose one that gives the outputs that are read"
            self._unfit.add((name, port))
            self.faults.add(stand_in.block.kind_place, problem, remedy, subject=f"block '{name}'")
        return not problem

    def _source(self, scope: Scope, given: InputSpec) -> Source:
        if given.source is UNKNOWN:
            return Source(given.place, UNKNOWN)
        if isinstance(given.source, tuple):
            problem = "this input takes one signal, not a list of them"
            self.faults.add(given.place, problem, "join them with a block 'signal.concatenate'")
            return Source(given.place, UNKNOWN)
        if isinstance(given.source, YamlNode):
            return Source(given.place, substitute(given.source, scope.params, self.faults))
        found = self.find(scope, given.source)
        if not isinstance(found.source, Wire):
            return found
        if given.over is not None:
            found = found._replace(over=given.over)
        if given.initial is not None:
            initial = substitute(given.initial, scope.params, self.faults)
            found = found._replace(initial=initial if known(initial) else None)
        if given.across is None:
            return found
        if given.across is UNKNOWN:
            return found._replace(across=UNKNOWN)
        assert isinstance(found.source, Wire)
        wire = replace(found.source, crossing=given.across)
        return found._replace(source=wire, across=given.across_place)

    def _inside(self, scope: Scope, reference: Reference) -> Source:
        if scope.parent is None:
            problem = "'in' names the inputs of a part, and a diagram has none"
            self.faults.add(reference.place, problem, "name a block")
        elif reference.port not in scope.spec[PORTS].inputs:
            remedy = (
                suggestion(reference.port, scope.spec[PORTS].inputs)
                or "declare it under 'ports: {in: [...]}'"
            )
            self.faults.add(reference.place, f"this part has no input '{reference.port}'", remedy)
        else:
            return self._entry(scope, reference.port)
        return Source(reference.place, UNKNOWN)

    def _entry(self, scope: Scope, port: str) -> Source:
        """Return the source of an input of a part."""
        assert scope.instance is not None and scope.parent is not None
        inputs = scope.instance.inputs or {}
        if inputs is UNKNOWN:
            return Source(scope.instance.place, UNKNOWN)
        given = inputs.get(port) or scope.spec[PORTS].defaults.get(port)
        if given is None:
            return Source(scope.instance.place, OpenInput(scope, port))
        key = (f"{scope.prefix}{INSIDE}", port)
        if self._begin(key, scope, scope.spec[PORTS].inputs[port]):
            with self.faults.about(scope.subject):
                self._found[key] = self._source(scope.parent, given)
            self._sought.discard(key)
        return self._found[key]

    def _export(self, scope: Scope, port: str) -> Source:
        """Return the source of an output of a part: a signal in it, or what shows it while the part runs."""
        reference = scope.spec[PORTS].outputs[port]
        shown = self.shown.get((scope.prefix, port))
        if shown is not None and known(reference):
            return Source(reference.place, shown)
        return self.inner(scope, port)

    def inner(self, scope: Scope, port: str) -> Source:
        """Return the signal in a part that is the source of an output."""
        reference = scope.spec[PORTS].outputs[port]
        if reference is UNKNOWN:
            return Source(scope.spec.place, UNKNOWN)
        key = (scope.prefix, port)
        if self._begin(key, scope, reference.place):
            with self.faults.about(scope.subject):
                self._found[key] = self.find(scope, reference)
            self._sought.discard(key)
        return self._found[key]

    def _begin(self, key: tuple[str, str], scope: Scope, place: Place) -> bool:
        """Say whether a port is still to be looked at; one that is being looked at leads back to itself."""
        if key in self._found:
            return False
        problem, remedy = "", "wire it to a block"
        if key in self._sought:
            problem = f"port '{key[1]}' of the part leads back to itself, through no block"
        elif len(self._sought) >= MAX_PORTS:
            problem = f"port '{key[1]}' leads through more than {MAX_PORTS} ports of parts and no block"
        if problem:
            self.faults.add(place, problem, remedy, subject=scope.subject)
            self._found[key] = Source(place, UNKNOWN)
            return False
        self._sought.add(key)
        return True

    def _indexed(self, found: Source, reference: Reference) -> Source:
        if not reference.index or found.source is UNKNOWN or isinstance(found.source, OpenInput):
            return found
        place = reference.place
        if isinstance(found.source, YamlNode):
            part = _element(found.source, reference.index)
            if part is UNKNOWN:
                self.faults.add(place, "the constant has no such element", "count from 0")
            return Source(place, part)
        if found.source.index:
            problem = "the signal is an element or a run already, it cannot take a second index"
            self.faults.add(place, problem, "write one index")
            return Source(place, UNKNOWN)
        return found._replace(place=place, source=replace(found.source, index=reference.index))


def _owner(scope: Scope, name: str) -> tuple[Scope, str]:
    """Return the scope in which a block is named, and its name there: names may reach into parts."""
    head, slash, rest = name.partition("/")
    child = scope.children.get(head, UNKNOWN)
    if slash and name not in scope.spec[BLOCKS] and known(child):
        return _owner(child, rest)
    return scope, name


def _element(node: YamlNode, index: Index) -> YamlNode | Unknown:
    """Return a part of a constant, if there is one."""
    for part in index:
        if not isinstance(node, YamlList):
            return UNKNOWN
        if isinstance(part, slice):
            values = node.values[part]
            if len(index) > 1 or not values or (part.stop or 0) > len(node):
                return UNKNOWN
            return YamlList(values, node.file, node.line, node.column, node.key)
        if part >= len(node):
            return UNKNOWN
        node = node[part]
    return node
