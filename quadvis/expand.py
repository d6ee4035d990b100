"""From files to a flat list of blocks: parts expanded, variant applied, settings in place, signals found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from quadvis.document import Node
from quadvis.errors import Faults, Place, suggestion
from quadvis.graph import Wire
from quadvis.loader import (
    BlockSpec,
    FileSpec,
    InputSpec,
    Reference,
    read_block,
    read_file,
    substitute,
)


@dataclass
class Scope:
    """The names that one file's blocks see. ``prefix`` is the path of the part that the file was used for."""

    prefix: str
    spec: FileSpec
    params: dict[str, Node]
    parent: Scope | None = None
    instance: BlockSpec | None = None
    children: dict[str, Scope] = field(default_factory=dict)
    broken: set[str] = field(default_factory=set)  # parts that could not be read

    @property
    def rate(self) -> tuple[str, Place] | None:
        """The rate of the nearest part around, for blocks that name none."""
        if self.instance is None or self.parent is None:
            return None
        if self.instance.rate is not None and self.instance.rate_place is not None:
            return self.instance.rate, self.instance.rate_place
        return self.parent.rate


@dataclass(frozen=True)
class FlatBlock:
    """One block of the catalogue under its full path, with parameters as nodes and rate as a name."""

    path: str
    spec: BlockSpec
    scope: Scope
    parameters: dict[str, Node]
    rate: tuple[str, Place] | None


@dataclass(frozen=True)
class Source:
    """What an input is given after all parts are resolved: a wire or a constant node; None was told already."""

    place: Place
    source: Wire | Node | None
    across: Place | None = None


class Expansion:
    """The flat form of a diagram; ``blocks`` are in the order of the files."""

    def __init__(
        self, spec: FileSpec, settings: Mapping[str, Mapping[str, Node]], variant: str | None, faults: Faults
    ) -> None:
        self.faults = faults
        self.settings = settings
        self.used: set[tuple[str, str]] = set()
        self.blocks: list[FlatBlock] = []
        self.unknown: set[str] = set(spec.broken)
        slots = self._slots(spec, variant) if variant is not None else {}
        spec = replace(spec, blocks={name: slots.get(name, block) for name, block in spec.blocks.items()})
        params = {name: self._setting("", name) or node for name, node in spec.params.items()}
        self.root = Scope("", spec, params)
        self._expand(self.root, (spec.path.resolve(),))
        self._tell_unused()

    def _setting(self, path: str, name: str) -> Node | None:
        node = self.settings.get(path, {}).get(name)
        if node is not None:
            self.used.add((path, name))
        return node

    def _tell_unused(self) -> None:
        paths = [block.path for block in self.blocks]
        for path, values in self.settings.items():
            for name, node in values.items():
                if (path, name) in self.used or path in self.unknown:
                    continue
                place = Place(node.file)
                if path:
                    self.faults.add(place, f"there is no block '{path}'", suggestion(path, paths), subject="")
                else:
                    remedy = suggestion(name, self.root.spec.params) or "set a block's with 'block.parameter=value'"
                    self.faults.add(place, f"the diagram has no parameter '{name}'", remedy, subject="")

    def _slots(self, spec: FileSpec, variant: str) -> dict[str, BlockSpec]:
        """Return the blocks that a variant puts into slots."""
        if variant not in spec.variants:
            remedy = suggestion(variant, spec.variants) or "the diagram has no variants"
            self.faults.add(spec.place, f"there is no variant '{variant}'", remedy, subject="")
            return {}
        node = spec.variants[variant].get("slots")
        mapping = self.faults.collect(node.mapping) if node is not None else None
        found = {}
        for key, value in mapping.pairs() if mapping is not None else []:
            name = key.value
            base = spec.blocks.get(name)
            with self.faults.about(f"block '{name}'"):
                if base is None or not base.slot:
                    open_slots = [block.name for block in spec.blocks.values() if block.slot]
                    what = "is not a slot" if base else "is not in the diagram"
                    remedy = suggestion(name, open_slots) if base is None else "write 'slot: true' in the block"
                    self.faults.add(key.place, f"variant '{variant}' fills '{name}', which {what}", remedy)
                    continue
                block = read_block(name, key.place, value, self.faults)
            if block is not None:
                inputs = base.inputs if block.inputs is None else block.inputs
                rate, place = (block.rate, block.rate_place) if block.rate else (base.rate, base.rate_place)
                found[name] = replace(block, slot=True, inputs=inputs, rate=rate, rate_place=place)
        return found

    def _expand(self, scope: Scope, files: tuple[Path, ...]) -> None:
        for block in scope.spec.blocks.values():
            path = scope.prefix + block.name
            with self.faults.about(f"block '{path}'"):
                values = {}
                for name, node in block.parameters.items():
                    value = substitute(node, scope.params, self.faults)
                    if value is not None:
                        values[name] = value
                    elif not block.is_part:
                        self.unknown.add(path)
                for name in self.settings.get(path, {}):
                    node = self._setting(path, name)
                    assert node is not None
                    values[name] = node
                if block.is_part:
                    self._expand_part(scope, block, values, files)
                else:
                    rate = (block.rate, block.rate_place) if block.rate and block.rate_place else scope.rate
                    self.blocks.append(FlatBlock(path, block, scope, values, rate))

    def _expand_part(self, scope: Scope, block: BlockSpec, values: dict[str, Node], files: tuple[Path, ...]) -> None:
        file = Path(block.kind_place.file).parent / block.kind
        if file.resolve() in files:
            self.faults.add(block.kind_place, f"part '{block.kind}' contains itself", "use another file")
            scope.broken.add(block.name)
            return
        if not file.is_file():
            self.faults.add(block.kind_place, f"there is no file '{block.kind}'", "paths are relative to this file")
            scope.broken.add(block.name)
            return
        spec = read_file(file, self.faults, part=True)
        if spec is None:
            scope.broken.add(block.name)
            return
        for name, node in values.items():
            if name not in spec.params:
                place = block.parameter_places.get(name, node.place)
                remedy = suggestion(name, spec.params) or "it has none"
                self.faults.add(place, f"part '{block.kind}' has no parameter '{name}'", remedy)
        inputs = block.inputs or {}
        for name, given in inputs.items():
            if name not in spec.inputs:
                remedy = suggestion(name, spec.inputs) or "it has none"
                self.faults.add(given.place, f"part '{block.kind}' has no input '{name}'", remedy)
        for name in spec.inputs:
            if name not in inputs:
                self.faults.add(block.place, f"input '{name}' is not connected", f"add '{name}: block.port' under 'in'")
        prefix = f"{scope.prefix}{block.name}/"
        child = Scope(prefix, spec, spec.params | values, scope, replace(block, inputs=inputs))
        self.unknown |= {prefix + name for name in spec.broken}
        scope.children[block.name] = child
        self._expand(child, (*files, file.resolve()))

    def inputs(self, block: FlatBlock) -> Iterator[tuple[str, Source]]:
        """Yield what each input of a block is given."""
        for port, given in (block.spec.inputs or {}).items():
            yield port, self._source(block.scope, given)

    def _source(self, scope: Scope, given: InputSpec) -> Source:
        if given.source is None:
            return Source(given.place, None)
        if isinstance(given.source, Node):
            return Source(given.place, substitute(given.source, scope.params, self.faults))
        found = self.find(scope, given.source)
        if isinstance(found.source, Wire) and given.across is not None:
            return Source(given.place, replace(found.source, crossing=given.across), given.across_place)
        return replace(found, place=given.place)

    def find(self, scope: Scope, reference: Reference) -> Source:
        """Return the block and port behind a name, through the ports of parts."""
        place = reference.place
        if reference.block == "in":
            return self._through_input(scope, reference)
        child = scope.children.get(reference.block)
        if child is not None:
            inner = child.spec.outputs.get(reference.port)
            if inner is None:
                remedy = suggestion(reference.port, child.spec.outputs) or "it has none"
                self.faults.add(place, f"part '{reference.block}' has no output '{reference.port}'", remedy)
                return Source(place, None)
            found = self.find(child, inner)
            return self._indexed(found, reference)
        if reference.block in scope.broken:
            return Source(place, None)
        return Source(place, Wire(scope.prefix + reference.block, reference.port, reference.index))

    def _through_input(self, scope: Scope, reference: Reference) -> Source:
        place = reference.place
        if scope.instance is None or scope.parent is None:
            self.faults.add(place, "'in' names the inputs of a part; a diagram has none", "name a block")
            return Source(place, None)
        if reference.port not in scope.spec.inputs:
            remedy = suggestion(reference.port, scope.spec.inputs) or "declare it under 'ports: {in: [...]}'"
            self.faults.add(place, f"this part has no input '{reference.port}'", remedy)
            return Source(place, None)
        given = (scope.instance.inputs or {}).get(reference.port)
        if given is None:
            return Source(place, None)
        return self._indexed(self._source(scope.parent, given), reference)

    def _indexed(self, found: Source, reference: Reference) -> Source:
        if not reference.index or not isinstance(found.source, Wire):
            return replace(found, place=reference.place)
        if found.source.index:
            self.faults.add(reference.place, "the signal is a part already; it cannot take a second index", "index it once")
            return Source(reference.place, None)
        return Source(reference.place, replace(found.source, index=reference.index), found.across)
