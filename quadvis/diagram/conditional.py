"""What does not always run: a part or a single block with `when`, `triggered` or `reset`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from quadvis.diagram.expand import Expansion
from quadvis.diagram.reference import Reference
from quadvis.diagram.scope import FlatBlock, Scope
from quadvis.diagram.sections.conditional import HELD, PartCondition
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.wiring import Source, Wiring
from quadvis.errors import UNKNOWN, Place, known
from quadvis.graph.graph import CONTINUOUS, Wire

Run = tuple[str, str]  # a rate and a computer


@dataclass(frozen=True)
class Conditional:
    """A part or a block that does not always run, named in the scope ``around`` it.

    ``prefix`` begins the paths of what is added for it, as those of the blocks of a part.
    """

    prefix: str
    runs: PartCondition
    around: Scope
    part: Scope | None = None
    block: FlatBlock | None = None

    @property
    def word(self) -> str:
        """What it is."""
        return "part" if self.part is not None else "block"

    @property
    def subject(self) -> str:
        """How a fault names it."""
        return f"block '{self.prefix[:-1]}'"

    @property
    def outputs(self) -> Mapping[str, Place]:
        """Its outputs, and where they are declared."""
        if self.block is not None:
            kind = self.block.kind
            return dict.fromkeys(kind.interface.outputs if known(kind) else (), self.runs.place)
        assert self.part is not None
        place, ports = self.part.spec.place, self.part.spec[PORTS].outputs
        return {name: each.place if known(each) else place for name, each in ports.items()}

    @property
    def shown(self) -> tuple[str, ...]:
        """The outputs that have a block to show them, while it runs or pauses.

        A block that pauses holds its outputs by itself; so it needs none as long as they have no other
        initial values than 0, to which nothing sets them back.
        """
        held = self.block is not None and self.runs.outputs == HELD and not self.runs.initial
        return () if held or not self.runs.pauses else tuple(self.outputs)

    def has(self, flat: FlatBlock) -> bool:
        """Say whether a block is this one, or lies in this part."""
        return flat is self.block if self.block is not None else flat.path.startswith(self.prefix)

    def members(self, blocks: Mapping[str, FlatBlock]) -> dict[Run, FlatBlock]:
        """Return the rates and computers of its blocks, with the first block of each."""
        found: dict[Run, FlatBlock] = {}
        for flat in blocks.values():
            run = run_of(flat)
            if run is not None and self.has(flat):
                found.setdefault(run, flat)
        return found

    def source(self, port: str, wiring: Wiring) -> Source | None:
        """Return the signal in it that is an output; None if that is faulty."""
        if self.block is not None:
            return Source(self.runs.place, Wire(self.block.path, port))
        assert self.part is not None
        reference: Reference | object = self.part.spec[PORTS].outputs[port]
        found = wiring.inner(self.part, port) if reference is not UNKNOWN else None
        return None if found is None or found.source is UNKNOWN else found


def conditional_parts(scope: Scope) -> Iterator[Conditional]:
    """Yield the parts in a scope that do not always run, outer ones first."""
    for child in scope.parts:
        if child.runs is not None:
            yield Conditional(child.prefix, child.runs, scope, part=child)
        yield from conditional_parts(child)


def conditional_blocks(expansion: Expansion) -> Iterator[Conditional]:
    """Yield the blocks that do not always run."""
    for flat in expansion.blocks.values():
        if flat.spec.runs is not None and known(flat.spec.runs):
            yield Conditional(f"{flat.path}/", flat.spec.runs, flat.scope, block=flat)


def run_of(flat: FlatBlock) -> Run | None:
    """Return the rate and the computer of a block; None if they are not known."""
    if not known(flat.kind) or flat.at is UNKNOWN:
        return None
    rate = (CONTINUOUS, None) if flat.kind.interface.continuous else flat.rate
    if rate is None or not known(rate):
        return None
    return rate[0], flat.at[0] if flat.at is not None and known(flat.at) else ""
