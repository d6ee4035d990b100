"""Variants: other blocks in the slots of a diagram, with the same outputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from quadvis.block import Out
from quadvis.diagram.loader import BlockSpec, FileSpec
from quadvis.errors import Faults, suggestion

Outputs = Mapping[str, Mapping[str, Out]]  # by slot and port
Refused = set[tuple[str, str]]  # slots and ports that another block should have, which is told


def fill_slots(spec: FileSpec, variant: str | None, faults: Faults) -> FileSpec:
    """Return the diagram with a variant's blocks in their slots; faults of all variants are told."""
    if variant is not None and variant not in spec.variants:
        remedy = suggestion(variant, spec.variants) or "the diagram has no variants"
        faults.add(spec.place, f"there is no variant '{variant}'", remedy)
    lineages = {name: _lineage(spec, name, faults) for name in spec.variants}
    blocks = dict(spec.blocks)
    fitting = {name: dict(_fitting(spec, name, faults)) for name in spec.variants}
    for name in reversed(lineages.get(variant or "", [])):
        for slot, block in fitting[name].items():
            blocks[slot] = _in_slot(spec.blocks[slot], block)
    return replace(spec, blocks=blocks)


def _lineage(spec: FileSpec, variant: str, faults: Faults) -> list[str]:
    """Return a variant, the one on which it builds, and so on; what is wrong with its own base is told."""
    names = [variant]
    while names[-1] in spec.bases:
        base, place = spec.bases[names[-1]]
        own = len(names) == 1
        if base not in spec.variants:
            if own:
                remedy = suggestion(base, [name for name in spec.variants if name != variant])
                faults.add(place, f"variant '{variant}' builds on '{base}', which is none", remedy)
            return names
        if base in names:
            if base == variant:
                faults.add(place if own else spec.bases[variant][1], f"variant '{variant}' builds on itself")
            return names
        names.append(base)
    return names


def _fitting(spec: FileSpec, variant: str, faults: Faults) -> Iterator[tuple[str, BlockSpec]]:
    """Yield what a variant puts into slots that are there; the others are told."""
    for slot, block in spec.variants[variant].items():
        if block is None or slot in spec.broken:
            continue
        base = spec.blocks.get(slot)
        if base is None:
            remedy = suggestion(slot, [known for known, block in spec.blocks.items() if block.slot])
            problem = f"variant '{variant}' fills '{slot}', which is not in the diagram"
            faults.add(block.place, problem, remedy)
        elif base.slot is not None:
            yield slot, block
        elif "slot" not in base.told:
            problem = f"variant '{variant}' fills '{slot}', which is not a slot"
            faults.add(block.place, problem, f"write 'slot: true' in block '{slot}'")


def _in_slot(base: BlockSpec, block: BlockSpec) -> BlockSpec:
    """Return what is put into a slot: it takes the slot's wires and rate unless it brings its own."""
    inputs = base.inputs if block.inputs is None else block.inputs
    return replace(block, slot=base.slot, inputs=inputs, rate=block.rate or base.rate)


def check_slots(
    spec: FileSpec, filled: FileSpec, promised: Outputs, given: Outputs, faults: Faults
) -> Refused:
    """Tell the outputs that a block in a slot lacks, or has of another kind, and return them."""
    refused = set()
    for slot, outputs in given.items():
        before, now = spec.blocks[slot], filled.blocks[slot]
        for port, wanted in promised[slot].items():
            offered = outputs.get(port)
            problem = ""
            if offered is None:
                problem = f"'{now.kind}' has no output '{port}', which '{before.kind}' gives in this slot"
            elif _differ(offered, wanted):
                this, that = _words(offered), _words(wanted)
                problem = f"output '{port}' of '{now.kind}' is {this}, that of '{before.kind}' is {that}"
            if problem:
                refused.add((slot, port))
                remedy = "choose one with the same outputs"
                faults.add(now.kind_place, problem, remedy, subject=f"block '{slot}'")
    return refused


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
