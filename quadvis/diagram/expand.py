"""From files to a flat list of blocks: parts expanded, settings in place, every block with its class."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from quadvis.block import Block, ParameterError
from quadvis.diagram.draft import not_taken
from quadvis.diagram.group import Group
from quadvis.diagram.group_files import GroupFiles
from quadvis.diagram.names import remedy_for
from quadvis.diagram.overrides import Overrides
from quadvis.diagram.parameters import Params, substitute
from quadvis.diagram.parts import Parts
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.settings import Settings
from quadvis.diagram.settled import settled
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.timing import timed
from quadvis.diagram.values import file_fault, read_parameter
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import (
    UNKNOWN,
    DiagramError,
    Faults,
    Place,
    QuadvisError,
    Unknown,
    known,
    suggestion,
)
from quadvis.library.catalogue import Catalogue, CatalogueError

MAX_BLOCKS = 50_000  # in parts, since parts in parts multiply; a file by itself is as long as it is
MAX_DEPTH = 30


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
        groups: GroupFiles,
        faults: Faults,
        kept: dict[str, list[Kept]],
    ) -> None:
        self.catalogue, self.parts, self.faults = catalogue, parts, faults
        self.groups, self.kept, self.overrides = groups, kept, Overrides(settings, faults)
        self.blocks: dict[str, FlatBlock] = {}
        self._unknown: set[str] = set()  # paths of blocks and parts that exist, and are `UNKNOWN`
        self._count = 0
        params = {name: self._parameter(name, node) for name, node in spec[PARAMS].items()}
        whole = settled(params, faults)
        self.spec = timed(spec, whole, self.overrides, faults)
        self.root = Scope("", spec, whole)
        self._expand(self.root, (os.path.realpath(spec.path),))
        self.overrides.report_unused(lambda path: not self.knows(path), self.blocks, spec[PARAMS])
        self._report_doubled()

    @property
    def is_whole(self) -> bool:
        """Whether all blocks and parts are known."""
        return not self._unknown

    def knows(self, path: str) -> bool:
        """Say whether a block or part, and every part around it, is known as far as it exists."""
        return not any(path == other or path.startswith(f"{other}/") for other in self._unknown)

    def _parameter(self, name: str, own: YamlNode | Unknown) -> YamlNode | Unknown:
        """Return the value of a parameter of the diagram; settings may replace those inside a group."""
        value = self.overrides.chosen("", name, own)
        with self.faults.about(f"parameter '{name}'"):
            found = self.groups.resolved(own, value)
        given = self.overrides.of(name)
        if not isinstance(found, Group) or not given:
            return found
        entries = {}
        for entry, setting in given.items():
            own = found.entries.get(entry, UNKNOWN)
            entries[entry] = self.overrides.chosen(name, entry, own)
            if entry not in found.entries:
                remedy = suggestion(entry, found.entries)
                problem = f"group '{name}' has no parameter '{entry}'"
                self.faults.add(setting.place, problem, remedy)
        return found.replaced(entries)

    def _report_doubled(self) -> None:
        """Report groups with the name of a block: a setting would not say which of them it means."""
        for name, node in self.root.params.items():
            if isinstance(node, Group) and name in self.root.spec[BLOCKS]:
                problem = f"both a group and a block are called '{name}', so a setting could mean either"
                self.faults.add(node.place, problem, "choose another name for one of them")

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
                    if block.groups:
                        places = {**dict.fromkeys(values, block.groups[0].place), **places}
                    self.blocks[path] = FlatBlock(path, block, scope, kind, values, places)

    def _read(self, scope: Scope, block: BlockSpec, path: str) -> Kept:
        """Return the parameters of a block or part, and the class of a block."""
        for kept in self.kept.get(path, ()):
            if kept.entry is block and kept.params == scope.params:
                return kept
        before = len(self.faults)
        values = self._values(scope, block, path)
        kind: type[Block] | Unknown = UNKNOWN
        if not block.is_part:
            self._refuse_groups(block, values)
            kind = self._class(block)
            if known(kind) and kind.free_names:
                kind = self._named(kind, block, values)
            if known(kind):
                values = self._with_taken(scope, block, kind.interface.params, values)
                kind = self._with_ports(kind, block, values)
            if kind is UNKNOWN:
                self._unknown.add(path)
        found = Kept(block, scope.params, values, kind)
        if len(self.faults) == before and not self.overrides.of(path):
            self.kept.setdefault(path, []).append(found)
        return found

    def _values(self, scope: Scope, block: BlockSpec, path: str) -> dict[str, YamlNode | Unknown]:
        """Return the parameters of a block or part."""
        given = block.parameters if known(block.parameters) else {}
        values = {name: substitute(node, scope.params, self.faults) for name, node in given.items()}
        for name in self.overrides.of(path):
            values[name] = self.overrides.chosen(path, name, values.get(name, UNKNOWN))
        return values

    def _places(self, block: BlockSpec, path: str) -> Mapping[str, Place]:
        """Return where the parameters of a block or part are given their values."""
        settings = self.overrides.of(path)
        if not settings:
            return block.parameter_places
        return block.parameter_places | {name: setting.place for name, setting in settings.items()}

    def _with_taken(
        self,
        scope: Scope,
        block: BlockSpec,
        declared: Mapping[str, Any],
        given: dict[str, YamlNode | Unknown],
    ) -> dict[str, YamlNode | Unknown]:
        """Return the parameters of a block or part, and those that it takes from groups besides."""
        found: dict[str, YamlNode | Unknown] = {}
        for node in block.groups:
            group = substitute(node, scope.params, self.faults)
            if not known(group):
                continue
            taken = group.take_all(declared) if isinstance(group, Group) else {}
            twice = [name for name in taken if name in found and name not in given]
            if not isinstance(group, Group):
                self.faults.add(node.place, "this is not a group", "write '$name' of a group under 'params'")
            elif not taken:
                problem = f"'{block.kind}' has no parameter of the group '{node.text()[1:]}'"
                self.faults.add(node.place, problem, "leave it out")
            elif twice:
                problem = f"more than one of these groups has '{twice[0]}'"
                self.faults.add(node.place, problem, f"give '{twice[0]}' under 'with'")
            found |= taken
        return found | given

    def _refuse_groups(self, block: BlockSpec, values: dict[str, YamlNode | Unknown]) -> None:
        """Report groups in place of values of a block; they become `UNKNOWN`."""
        for name, node in values.items():
            if isinstance(node, Group):
                place = block.parameters[name].place if known(block.parameters) else node.place
                remedy = (
                    "name one of its parameters, as in '$group.name', or write 'group: $group' beside 'with'"
                )
                self.faults.add(place, f"'{name}' takes a value, not a group of parameters", remedy)
                values[name] = UNKNOWN

    def _class(self, block: BlockSpec) -> type[Block] | Unknown:
        try:
            return self.catalogue.find(block.kind)
        except CatalogueError as error:
            self.faults.add(block.kind_place, error.problem, error.remedy)
            return UNKNOWN

    def _named(
        self, kind: type[Block], block: BlockSpec, values: Mapping[str, YamlNode | Unknown]
    ) -> type[Block] | Unknown:
        """Return the class of a block to which its entry gives the names."""
        if not known(block.parameters) or block.inputs is UNKNOWN or UNKNOWN in values.values():
            return UNKNOWN
        given = {
            name: node.value if isinstance(node, YamlScalar) else node.to_python()
            for name, node in values.items()
            if known(node)
        }
        inputs = block.inputs if block.inputs is not None and known(block.inputs) else {}
        try:
            return kind.named(given, tuple(inputs))
        except ParameterError as error:
            node = values.get(error.parameter)
            place = node.place if node is not None and known(node) else block.place
            if error.parameter in inputs:
                place = inputs[error.parameter].place
            self.faults.add(place, str(error))
        return UNKNOWN

    def _with_ports(
        self, kind: type[Block], block: BlockSpec, values: Mapping[str, YamlNode | Unknown]
    ) -> type[Block] | Unknown:
        """Return the class with the ports that it has for its parameters, where they depend on some."""
        entries = self._entries(kind, block)
        if not known(entries):
            return UNKNOWN
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
            return kind.with_ports(given, entries)
        except DiagramError as error:  # the faults of a file, each at its place
            for fault in error.faults:
                self.faults.append(file_fault(fault, values, given, self.faults.subject))
        except QuadvisError as error:
            node = values.get(error.parameter) if isinstance(error, ParameterError) else None
            place = node.place if node is not None and known(node) else block.place
            self.faults.add(place, "; ".join(str(error).splitlines()))
        return UNKNOWN

    def _entries(self, kind: type[Block], block: BlockSpec) -> dict[str, int] | Unknown:
        """Return how many signals each input of any number has, as far as it is wired."""
        if not kind.interface.many:
            return {}
        inputs = block.inputs if block.inputs is not None and known(block.inputs) else {}
        found = {name: inputs[name] for name in kind.interface.many if name in inputs}
        for name, given in found.items():
            if not given.entries:
                self.faults.add(given.place, f"input '{name}' has no signal", "list one at least")
                return UNKNOWN
        return {name: len(given.entries) for name, given in found.items()}

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
        values = self._with_taken(scope, block, spec[PARAMS], values)
        params: Params = {
            name: self.groups.resolved(own, values.get(name, own)) for name, own in spec[PARAMS].items()
        }
        params = settled(params, self.faults)
        child = Scope(f"{scope.prefix}{block.name}/", spec, params, scope, block)
        scope.children[block.name] = child
        self._expand(child, (*files, self.parts.locate(block)[1]))

    def _check_inputs(
        self, block: BlockSpec, inputs: Mapping[str, InputSpec], declared: Collection[str]
    ) -> None:
        for name, given in inputs.items():
            if name not in declared and block.inherits:
                self.faults.add(block.place, *not_taken(name, block.kind))
            elif name not in declared:
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
