"""Variants: other blocks in the slots of a diagram, with the same outputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from quadvis.block import Out
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.variants import VARIANTS, Variants
from quadvis.diagram.spec import FileSpec
from quadvis.errors import UNKNOWN, Faults, known, suggestion

Outputs = Mapping[str, Mapping[str, Out]]  # by slot and port
Pair = tuple[BlockSpec, BlockSpec]  # the block in a slot, and the variant's block for it


def fill_slots(spec: FileSpec, variant: str | None, faults: Faults) -> FileSpec:
    """Return the diagram with a variant's blocks in their slots; faults of all variants are reported."""
    variants = spec[VARIANTS]
    if variant is not None and variant not in variants:
        remedy = suggestion(variant, variants) or "the diagram has no variants"
        faults.add(spec.place, f"there is no variant '{variant}'", remedy)
    lineages = {name: _lineage(variants, name, faults) for name in variants}
    blocks = dict(spec[BLOCKS])
    fitting = {name: dict(_fitting(spec, name, faults)) for name in variants}
    for name in reversed(lineages.get(variant or "", [])):
        for slot, (base, block) in fitting[name].items():
            blocks[slot] = _in_slot(base, block)
    return replace(spec, values=spec.values.replaced(BLOCKS, blocks))


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


def _fitting(
    spec: FileSpec, variant: str, faults: Faults
) -> Iterator[tuple[str, tuple[BlockSpec, BlockSpec]]]:
    """Yield for each slot the diagram's block and the variant's; report blocks without a slot."""
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
            yield slot, (base, block)


def _in_slot(base: BlockSpec, block: BlockSpec) -> BlockSpec:
    """Return the block for a slot: it has the slot's wires and rate unless it has its own."""
    inputs = base.inputs if block.inputs is None else block.inputs
    return block._replace(slot=base.slot, inputs=inputs, rate=block.rate or base.rate)


def check_slots(
    spec: FileSpec, filled: FileSpec, promised: Outputs, given: Outputs, faults: Faults
) -> set[tuple[str, str]]:
    """Report the outputs that a block in a slot lacks, or has of another kind; return slots and ports."""
    found = set()
    for slot, outputs in given.items():
        before, now = spec[BLOCKS][slot], filled[BLOCKS][slot]
        assert known(before) and known(now)
        for port, wanted in promised[slot].items():
            offered = outputs.get(port)
            problem = ""
            if offered is None:
                problem = f"'{now.kind}' has no output '{port}', which '{before.kind}' gives in this slot"
            elif _differ(offered, wanted):
                this, that = _words(offered), _words(wanted)
                problem = f"output '{port}' of '{now.kind}' is {this}, that of '{before.kind}' is {that}"
            if problem:
                found.add((slot, port))
                remedy = "choose one with the same outputs"
                faults.add(now.kind_place, problem, remedy, subject=f"block '{slot}'")
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
