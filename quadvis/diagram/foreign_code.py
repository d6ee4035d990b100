"""Files that a run executes, such as functional mock-up units: announced, or refused as own blocks are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, known
from quadvis.errors.caller import as_given
from quadvis.library.catalogue import OwnBlocks


def check_code(drafts: Sequence[Draft], own_blocks: OwnBlocks, faults: Faults) -> None:
    """Report files of code where none is to be run, or announce them."""
    for draft in drafts:
        if not known(draft.block) or not (name := draft.block.brings_code):
            continue
        path = getattr(draft.block, name)
        if callable(own_blocks):
            own_blocks(Path(path))
        elif not own_blocks:
            with faults.about(f"block '{draft.path}'"):
                problem = f"'{Path(path).name}' is machine code, which is not to be run"
                refusal = as_given("--no-own-blocks", "own_blocks=False")
                faults.add(
                    draft.places.get(name, draft.place), problem, f"leave {refusal} out if you trust it"
                )
