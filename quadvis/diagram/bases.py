"""Diagrams that stand on others: the base is read, and the diagram that names it changes it.

Entries with names (`MERGED`) are merged name by name; every other section that is written replaces that of
the base. Every value keeps the file in which it stands, so its paths are relative to that file.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from quadvis.diagram.keys import FILE_SECTIONS
from quadvis.diagram.loader import read_file
from quadvis.diagram.sections.base import BASE, MERGED, WITHOUT
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.section import Values
from quadvis.diagram.sections.summary import SUMMARY
from quadvis.diagram.sections.variants import VARIANTS
from quadvis.diagram.sections.without import kept
from quadvis.diagram.slots import fill_slots, in_slot
from quadvis.diagram.spec import FileSpec
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Unknown, known, suggestion
from quadvis.machine.missing_file import base_trouble
from quadvis.machine.shipped import named_file


def read_diagram(path: Path, faults: Faults) -> FileSpec | Unknown:
    """Read a diagram, and the diagrams on which it stands; faults are collected."""
    return standing(read_file(path, faults), faults)


def standing(spec: FileSpec | Unknown, faults: Faults, users: tuple[str, ...] = ()) -> FileSpec | Unknown:
    """Return a diagram with all that its base gives it; ``users`` are the real paths of the files above."""
    if spec is UNKNOWN or spec[BASE] is UNKNOWN:
        return UNKNOWN
    named = spec[BASE]
    if named is None:
        if WITHOUT.key in spec.written:
            problem, remedy = "'without' takes away from a base, and there is none", "add 'base: file.yaml'"
            faults.add(spec.top, problem, remedy)
        return spec
    assert known(named)
    users = (*users, os.path.realpath(spec.path))
    path = named_file(named.file, named.place.file)
    problem, remedy = base_trouble(path, named.file, users)
    if problem:
        faults.add(named.place, problem, remedy)
        return UNKNOWN
    base = standing(read_file(path, faults), faults, users)
    if base is UNKNOWN:
        return UNKNOWN
    if named.variant is not None:
        base = fill_slots(base, named.variant, faults, named.variant_place)
    return _changed(base, spec, named.variant is None, faults)


def _changed(base: FileSpec, spec: FileSpec, has_variants: bool, faults: Faults) -> FileSpec:
    """Return a base with the changes of the diagram that stands on it, with or without its variants."""
    _checkkept(base, spec, faults)
    without = spec[WITHOUT]
    values = Values()
    for section in FILE_SECTIONS:
        if section in MERGED:
            values[section] = kept(base[section], without.get(section.key, ())) | spec[section]
        else:
            values[section] = (spec if section.key in spec.written else base)[section]
    values[BASE], values[WITHOUT] = spec[BASE], without
    removed = without.get(BLOCKS.key, ())
    before = kept(base[BLOCKS], removed)
    own = {name: _standing_in(before.get(name), block) for name, block in spec[BLOCKS].items()}
    values[BLOCKS] = before | own
    inherited = kept(base[VARIANTS], without.get(VARIANTS.key, ())) if has_variants else {}
    values[VARIANTS] = {name: variant.on(removed) for name, variant in inherited.items()} | spec[VARIANTS]
    return replace(
        spec, values=values, nodes=_nodes(base, spec), written=base.written | spec.written, base=base
    )


def _standing_in(before: BlockSpec | Unknown | None, block: BlockSpec | Unknown) -> BlockSpec | Unknown:
    """Return a block of the diagram as it stands in for a block of the base, if there is one."""
    if before is None or not known(before) or not known(block):
        return block
    return in_slot(before, block)


def _nodes(base: FileSpec, spec: FileSpec) -> dict[str, YamlNode]:
    """Return the sections that name signals; the lines of the summary are merged."""
    nodes = {**base.nodes, **spec.nodes}
    there, own = base.nodes.get(SUMMARY.key), spec.nodes.get(SUMMARY.key)
    if isinstance(there, YamlMap) and (own is None or isinstance(own, YamlMap)):
        removed = spec[WITHOUT].get(SUMMARY.key, ())
        keys, entries = kept(there.keys, removed), kept(there.values, removed)
        top = own if own is not None else there
        if own is not None:
            keys, entries = keys | own.keys, entries | own.values
        nodes[SUMMARY.key] = YamlMap(keys, entries, top.file, top.line, top.column, top.key)
    return nodes


def _checkkept(base: FileSpec, spec: FileSpec, faults: Faults) -> None:
    """Report names to be taken away that the base does not have."""
    summary = base.nodes.get(SUMMARY.key)
    for section in MERGED:
        if section is SUMMARY:
            there = list(summary) if isinstance(summary, YamlMap) else []
        else:
            there = list(base[section])
        for name, place in spec[WITHOUT].get(section.key, {}).items():
            if name not in there:
                problem = f"the base has no '{name}' under '{section.key}'"
                faults.add(place, problem, suggestion(name, there))
