"""Blocks in the place of others: in the slots of a variant, and in a diagram that stands on another one.

Such a block must give the outputs that are read, of the same kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from quadvis.block import Out
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.section import Section
from quadvis.diagram.sections.variants import VARIANTS, Variants
from quadvis.diagram.sections.without import kept
from quadvis.diagram.spec import FileSpec
from quadvis.errors import UNKNOWN, Faults, Place, known, suggestion

TAKEN_AWAY: tuple[Section[Any], ...] = (BLOCKS, COMPUTERS, LINKS)


def fill_slots(spec: FileSpec, variant: str | None, faults: Faults, place: Place | None = None) -> FileSpec:
    """Return the diagram with a variant's blocks in their slots; faults of all variants are reported.

    ``place`` is where the variant is named, if a file names it.
    """
    variants = spec[VARIANTS]
    if variant is not None and variant not in variants:
        remedy = suggestion(variant, variants) or "the diagram has no variants"
        faults.add(place or spec.place, f"there is no variant '{variant}'", remedy)
    lineages = {name: _lineage(variants, name, faults) for name in variants}
    blocks = dict(spec[BLOCKS])
    fitting = {name: dict(_fitting(spec, name, faults)) for name in variants}
    chosen = [*reversed(lineages.get(variant or "", []))]
    for name in chosen:
        for slot, block in fitting[name].items():
            before = blocks[slot]
            assert known(before)
            blocks[slot] = in_slot(before, block)
    values, nodes = spec.values.replaced(BLOCKS, blocks), {**spec.nodes}
    for name in variants:
        _check_changes(spec, name, faults)
    for change in (variants[name] for name in chosen):
        values = values.replaced(PARAMS, {**values[PARAMS], **change.params})
        for section in TAKEN_AWAY:
            values = values.replaced(section, kept(values[section], change.without.get(section.key, ())))
        nodes |= change.nodes
    return replace(spec, values=values, nodes=nodes, base=spec)


def _check_changes(spec: FileSpec, variant: str, faults: Faults) -> None:
    """Report parameters, and names that are taken away, which the diagram does not have."""
    change = spec[VARIANTS][variant]
    for name, value in change.params.items():
        if name not in spec[PARAMS] and known(value):
            problem = f"variant '{variant}' gives '{name}', which is no parameter of the diagram"
            faults.add(value.place, problem, suggestion(name, spec[PARAMS]))
    for section in TAKEN_AWAY:
        for name, place in change.without.get(section.key, {}).items():
            if name not in spec[section]:
                problem = f"the diagram has no '{name}' under '{section.key}'"
                faults.add(place, problem, suggestion(name, spec[section]))


def _lineage(variants: Variants, variant: str, faults: Faults) -> list[str]:
    """Return a variant, the one on which it builds, and so on; faults of its own base are reported."""
    names = [variant]
    own = variants[variant].base
    while (named := variants[names[-1]].base) is not None:
        base, place = named
        is_first = len(names) == 1
        if base not in variants:
            if is_first:
                remedy = suggestion(base, [name for name in variants if name != variant])
                faults.add(place, f"variant '{variant}' builds on '{base}', which is none", remedy)
            return names
        if base in names:
            if base == variant and own is not None:
                faults.add(own[1], f"variant '{variant}' builds on itself")
            return names
        names.append(base)
    return names


def _fitting(spec: FileSpec, variant: str, faults: Faults) -> Iterator[tuple[str, BlockSpec]]:
    """Yield the variant's block for each slot; report blocks without a slot."""
    blocks = spec[BLOCKS]
    for slot, block in spec[VARIANTS][variant].slots.items():
        base = blocks.get(slot)
        if block is UNKNOWN or base is UNKNOWN:
            continue
        if base is None:
            remedy = suggestion(slot, [name for name, other in blocks.items() if known(other) and other.slot])
            problem = f"variant '{variant}' fills '{slot}', which is not in the diagram"
            faults.add(block.place, problem, remedy)
        elif base.slot is None:
            problem = f"variant '{variant}' fills '{slot}', which is not a slot"
            faults.add(block.place, problem, f"write 'slot: true' in block '{slot}'")
        elif known(base.slot):
            yield slot, block


def in_slot(base: BlockSpec, block: BlockSpec) -> BlockSpec:
    """Return the block for a slot, with the wires, rate, computer and condition before it if it has none."""
    if block.inputs is None:
        block = block._replace(inputs=base.inputs, inherits=True)
    slot = base.slot if block.slot is None else block.slot
    runs, condition = block.runs or base.runs, block.condition or base.condition
    return block._replace(
        slot=slot, rate=block.rate or base.rate, at=block.at or base.at, runs=runs, condition=condition
    )


class StandIn(NamedTuple):
    """A block in the place of another one, and the outputs of that one."""

    block: BlockSpec
    before: BlockSpec
    promised: Mapping[str, Out]

    def misfit(self, port: str, offered: Out | None, reader: Place) -> str:
        """Return what is wrong with an output of the block that something reads; "" if nothing is."""
        now, before, wanted = self.block.kind, self.before.kind, self.promised.get(port)
        if wanted is None:
            return ""
        if offered is None:
            return f"'{now}' has no output '{port}', which '{before}' gives here and {reader} reads"
        if _differ(offered, wanted):
            this, that = _words(offered), _words(wanted)
            return f"output '{port}' of '{now}' is {this}, that of '{before}' is {that}"
        return ""


def stand_ins(spec: FileSpec, outputs: Callable[[FileSpec, str], Mapping[str, Out]]) -> dict[str, StandIn]:
    """Return the blocks in the place of others, by name; ``outputs`` gives those of a block of a diagram."""
    found: dict[str, StandIn] = {}
    base = spec.base
    while base is not None:
        for name, before in base[BLOCKS].items():
            block = spec[BLOCKS].get(name)
            if name in found or block is before or block is None or not known(block) or not known(before):
                continue
            found[name] = StandIn(block, before, outputs(base, name))
        base = base.base
    return found


def _differ(offered: Out, wanted: Out) -> bool:
    """Say whether no signal fits both; what their declarations leave open the wires will show."""
    shapes = offered.signal.shape, wanted.signal.shape
    fixed = all(isinstance(size, int) for shape in shapes for size in shape)
    units = not any(unit.variables for unit in (*offered.units, *wanted.units))
    return (
        offered.signal.scalar != wanted.signal.scalar
        or (fixed and offered.signal.shape != wanted.signal.shape)
        or (units and offered.units != wanted.units)
    )


def _words(port: Out) -> str:
    return port.type if port.unit == "1" else f"{port.type} in {port.unit}"
