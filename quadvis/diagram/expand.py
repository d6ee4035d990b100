"""From files to a flat list of blocks: parts expanded, settings in place, every block with its class."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from quadvis.block import Block, ParameterError
from quadvis.diagram.names import remedy_for
from quadvis.diagram.parts import Parts
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec, InputSpec
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.settings import Settings
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.values import read_parameter, substitute
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import (
    UNKNOWN,
    DiagramError,
    Faults,
    Place,
    QuadvisError,
    Unknown,
    known,
    quoted,
    suggestion,
)
from quadvis.library.catalogue import Catalogue, CatalogueError
from quadvis.units import Unit, UnitError, split_quantity

MAX_BLOCKS = 50_000  # in parts, since parts in parts multiply; a file by itself is as long as it is
MAX_DEPTH = 30


def _is_unit(text: str) -> bool:
    try:
        return bool(Unit.parse(text).dimension) if text else False
    except UnitError:
        return False


class Kept(NamedTuple):
    """The parts of an entry without a fault, for the variants that have the same entry."""

    entry: BlockSpec
    params: Mapping[str, YamlNode | Unknown]  # that its scope has
    values: dict[str, YamlNode | Unknown]
    kind: type[Block] | Unknown  # `UNKNOWN` of a part


class Expansion:
    """The flat form of a diagram; ``blocks`` are in the order of the files, by path.

    ``kept`` holds entries by path, and is handed on from variant to variant.
    """

    def __init__(
        self,
        spec: FileSpec,
        catalogue: Catalogue,
        settings: Settings,
        parts: Parts,
        faults: Faults,
        kept: dict[str, Kept],
    ) -> None:
        self.catalogue, self.settings, self.parts, self.faults = catalogue, settings, parts, faults
        self.kept = kept
        self.blocks: dict[str, FlatBlock] = {}
        self._unknown: set[str] = set()  # paths of blocks and parts that exist, and are `UNKNOWN`
        self._count = 0
        self._used: set[tuple[str, str]] = set()
        params = {name: self._chosen("", name, node) for name, node in spec[PARAMS].items()}
        self.root = Scope("", spec, params)
        self._expand(self.root, (os.path.realpath(spec.path),))
        self._report_unused()

    @property
    def is_whole(self) -> bool:
        """Whether all blocks and parts are known."""
        return not self._unknown

    def knows(self, path: str) -> bool:
        """Say whether a block or part, and every part around it, is known as far as it exists."""
        return not any(path == other or path.startswith(f"{other}/") for other in self._unknown)

    def _chosen(self, path: str, name: str, own: YamlNode | Unknown) -> YamlNode | Unknown:
        """Return the value of a parameter: the setting if there is one.

        A setting without a unit for a value with one is refused here, before others are blamed for it.
        """
        self._used.add((path, name))
        setting = self.settings.get(path, {}).get(name)
        value = setting.value if setting is not None else UNKNOWN
        if setting is None or value is UNKNOWN:
            return own
        if not isinstance(value, YamlScalar) or not isinstance(own, YamlScalar):
            return value
        number, unit = split_quantity(value.value)
        wanted = split_quantity(own.value)[1]
        if not number or unit or not number.strip("+-0.") or not _is_unit(wanted):
            return value
        remedy = f"did you mean {quoted(f'{number} {wanted}')}?"
        self.faults.add(setting.place, f"{quoted(name)}: {quoted(number)} has no unit", remedy)
        return UNKNOWN

    def _report_unused(self) -> None:
        for path, values in self.settings.items():
            for name, setting in values.items():
                if (path, name) in self._used or not self.knows(path) or setting.value is UNKNOWN:
                    continue
                if path:
                    inner = [other for other in self.blocks if other.endswith(f"/{path}")]
                    remedy = f"did you mean '{inner[0]}'?" if inner else suggestion(path, self.blocks)
                    self.faults.add(setting.place, f"there is no block '{path}'", remedy)
                else:
                    remedy = suggestion(name, self.root.spec[PARAMS])
                    remedy = remedy or "a parameter of a block is set by 'block.parameter=value'"
                    self.faults.add(setting.place, f"the diagram has no parameter '{name}'", remedy)

    def _expand(self, scope: Scope, files: tuple[str, ...]) -> None:
        for name, block in scope.spec[BLOCKS].items():
            path = scope.prefix + name
            if block is UNKNOWN:
                self._unknown.add(path)
                continue
            with self.faults.about(f"block '{path}'"):
                self._count += scope.parent is not None
                if self._count > MAX_BLOCKS:
                    problem = f"there are more than {MAX_BLOCKS} blocks in parts"
                    self.faults.add(block.place, problem, "use fewer parts in parts")
                    raise DiagramError(self.faults)
                if block.slot is not None and known(block.slot) and scope.parent is not None:
                    self.faults.add(
                        block.slot, "a part has no slots", "make the whole part a slot of the diagram"
                    )
                if path in self.blocks and not block.is_part:
                    self._values(scope, block, path)
                    self.faults.add(block.place, f"there is a block '{path}' already", "choose another name")
                    continue
                _, _, values, kind = self._read(scope, block, path)
                if block.is_part:
                    self._expand_part(scope, block, values, files)
                else:
                    places = self._places(block, path)
                    self.blocks[path] = FlatBlock(path, block, scope, kind, values, places)

    def _read(self, scope: Scope, block: BlockSpec, path: str) -> Kept:
        """Return the parameters of a block or part, and the class of a block."""
        kept = self.kept.get(path)
        if kept is not None and kept.entry is block and kept.params == scope.params:
            return kept
        before = len(self.faults)
        values = self._values(scope, block, path)
        kind = UNKNOWN if block.is_part else self._find_kind(block, path, values)
        found = Kept(block, scope.params, values, kind)
        if len(self.faults) == before and path not in self.settings:
            self.kept[path] = found
        return found

    def _values(self, scope: Scope, block: BlockSpec, path: str) -> dict[str, YamlNode | Unknown]:
        """Return the parameters of a block or part."""
        given = block.parameters if known(block.parameters) else {}
        values = {name: substitute(node, scope.params, self.faults) for name, node in given.items()}
        for name in self.settings.get(path, {}):
            values[name] = self._chosen(path, name, values.get(name, UNKNOWN))
        return values

    def _places(self, block: BlockSpec, path: str) -> Mapping[str, Place]:
        """Return where the parameters of a block or part are given their values."""
        settings = self.settings.get(path, {})
        if not settings:
            return block.parameter_places
        return block.parameter_places | {name: setting.place for name, setting in settings.items()}

    def _find_kind(
        self, block: BlockSpec, path: str, values: Mapping[str, YamlNode | Unknown]
    ) -> type[Block] | Unknown:
        try:
            kind: type[Block] | Unknown = self._with_ports(self.catalogue.find(block.kind), block, values)
        except CatalogueError as error:
            self.faults.add(block.kind_place, error.problem, error.remedy)
            kind = UNKNOWN
        if kind is UNKNOWN:
            self._unknown.add(path)
        return kind

    def _with_ports(
        self, kind: type[Block], block: BlockSpec, values: Mapping[str, YamlNode | Unknown]
    ) -> type[Block] | Unknown:
        """Return the class with the ports that it has for its parameters, where they depend on some."""
        given: dict[str, Any] = {}
        for name in kind.ports_from():
            node = values.get(name)
            if node is None:
                continue
            read = (
                self.faults.read(read_parameter, kind.interface.params[name], node)
                if known(node)
                else UNKNOWN
            )
            if not known(read):
                return UNKNOWN
            given[name] = read[0]
        try:
            return kind.with_ports(given)
        except QuadvisError as error:
            node = values.get(error.parameter) if isinstance(error, ParameterError) else None
            place = node.place if node is not None and known(node) else block.place
            self.faults.add(place, "; ".join(str(error).splitlines()))
        return UNKNOWN

    def _expand_part(
        self, scope: Scope, block: BlockSpec, values: dict[str, YamlNode | Unknown], files: tuple[str, ...]
    ) -> None:
        spec = self._part(block, files)
        if spec is UNKNOWN:
            scope.children[block.name] = UNKNOWN
            self._unknown.add(scope.prefix + block.name)
            return
        places = self._places(block, scope.prefix + block.name)
        for name in values:
            if name not in spec[PARAMS]:
                problem = f"part '{block.kind}' has no parameter '{name}'"
                remedy = remedy_for(name, values, spec[PARAMS], replaces=name not in block.parameter_places)
                self.faults.add(places[name], problem, remedy)
        if block.inputs is not UNKNOWN:
            self._check_inputs(block, block.inputs or {}, spec[PORTS].inputs)
        child = Scope(f"{scope.prefix}{block.name}/", spec, spec[PARAMS] | values, scope, block)
        scope.children[block.name] = child
        self._expand(child, (*files, self.parts.locate(block)[1]))

    def _check_inputs(
        self, block: BlockSpec, inputs: Mapping[str, InputSpec], declared: Collection[str]
    ) -> None:
        for name, given in inputs.items():
            if name not in declared:
                problem = f"part '{block.kind}' has no input '{name}'"
                self.faults.add(given.place, problem, remedy_for(name, inputs, declared))

    def _part(self, block: BlockSpec, files: tuple[str, ...]) -> FileSpec | Unknown:
        problem, remedy = "", ""
        if self.parts.locate(block)[1] in files:
            problem, remedy = f"part '{block.kind}' contains itself", "use another file"
        elif len(files) > MAX_DEPTH:
            problem, remedy = f"parts are nested deeper than {MAX_DEPTH} files", "write them flatter"
        else:
            problem, remedy = self.parts.trouble(block, files)
        if problem:
            self.faults.add(block.kind_place, problem, remedy)
            return UNKNOWN
        return self.parts.read(block)
