"""The inputs of a diagram and the outputs of its blocks: no block writes an input or another's output."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from quadvis.block import Block
from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, Place, QuadvisError, quoted
from quadvis.library.own_package import own_files
from quadvis.machine.files import file_key, same_file
from quadvis.machine.source_line import file_of


class Writer(NamedTuple):
    """A block's parameter that names a file or folder which it writes."""

    block: str
    parameter: str
    path: str
    place: Place


def files_read(blocks: Iterable[Block], sources: Iterable[Path]) -> list[Path]:
    """Return every file that a run depends on: the YAML files, those of parameters, and the blocks' own."""
    found = dict.fromkeys(sources)
    kinds: set[type[Block]] = set()
    for block in blocks:
        kind = type(block)
        if kind not in kinds:
            kinds.add(kind)
            files = [Path(file_of(kind)), *own_files(kind.__module__)] if file_of(kind) else []
            found |= dict.fromkeys(files)
        found |= dict.fromkeys(map(Path, block.reads()))
    return list(found)


def files_written(blocks: Iterable[Block]) -> list[str]:
    """Return the files and folders that blocks write."""
    return [path for block in blocks for _, path in _written(block)]


def check_writers(drafts: Sequence[Draft], sources: Iterable[Path], faults: Faults) -> None:
    """Report blocks that would write over an input, into a folder that is played, or over another output."""
    blocks = {draft.path: draft.block for draft in drafts if isinstance(draft.block, Block)}
    writers = [
        Writer(draft.path, name, path, draft.places.get(name, draft.place))
        for draft in drafts
        if draft.path in blocks
        for name, path in _written(blocks[draft.path])
    ]
    if not writers:
        return
    inputs = files_read(blocks.values(), sources)
    played = {file_key(path): name for name, block in blocks.items() for path in _folders_read(block)}
    taken: dict[object, str] = {}
    for writer in writers:
        key, what = file_key(writer.path), f"{writer.parameter} {quoted(os.path.basename(writer.path))}"
        with faults.about(f"block '{writer.block}'"):
            if key in played:
                problem = f"{what} is the folder that block '{played[key]}' reads"
                faults.add(writer.place, problem, "name another one")
            elif same := same_file(writer.path, inputs):
                faults.add(
                    writer.place, f"{what} is an input ('{same}') and would be lost", "name another one"
                )
            elif key in taken:
                faults.add(writer.place, f"{what} is what block '{taken[key]}' writes", "name another one")
            else:
                _check_found(blocks[writer.block], writer, faults)
        taken.setdefault(key, writer.block)


def _check_found(block: Block, writer: Writer, faults: Faults) -> None:
    """Report what a block would write over, though it is neither an input nor another output."""
    try:
        block.check_written()
    except QuadvisError as error:
        faults.add(writer.place, str(error))


def check_log(path: str | os.PathLike[str], blocks: Iterable[Block]) -> None:
    """Refuse, with QuadvisError, a log where a block writes."""
    if file_key(path) in map(file_key, files_written(blocks)):
        raise QuadvisError(
            f"cannot write the log '{path}': a block of the diagram writes that; choose another name"
        )


def _written(block: Block) -> Iterator[tuple[str, str]]:
    for param in block.interface.files_written:
        if getattr(block, param.name):
            yield param.name, getattr(block, param.name)


def _folders_read(block: Block) -> Iterator[str]:
    for param in block.interface.files_read:
        if os.path.isdir(getattr(block, param.name)):
            yield getattr(block, param.name)
