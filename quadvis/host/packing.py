"""Packing: from a checked diagram to a bundle for a target, and the files that go with it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from quadvis.block.block import OWN_MODULES
from quadvis.errors import QuadvisError, quoted
from quadvis.machine.shipped import PREFIX, named_file
from quadvis.target.admission import sources_of
from quadvis.target.bundle import ApplicationBundle
from quadvis.version import __version__

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram


def pack(
    diagram: Diagram, name: str | None = None, engine: str = "auto", computers: Sequence[str] = ()
) -> tuple[ApplicationBundle, dict[str, Path]]:
    """Return a diagram as a bundle, and the paths of its files by their SHA-256.

    Files lie in the bundle as they lie beside the diagram. QuadvisError if one is named by an absolute path,
    if one is code, or if a block's code lies beside the diagram: a target runs what is installed there.
    """
    from quadvis.run.played_files import played_files

    _check_code(diagram)
    folder = diagram.path.parent
    names = {**_listed(diagram), **played_files(diagram)}
    names = {name: digest for name, digest in names.items() if not name.startswith(PREFIX)}
    above = max((_above(name) for name in names), default=0)
    home = _last_parts(folder, above)
    files, paths = {}, {}
    for each, digest in names.items():
        if PurePosixPath(each).is_absolute():
            raise QuadvisError(
                f"the file {quoted(each)} cannot go to a target: name it relative to the diagram"
            )
        files[os.path.normpath(home / each)] = digest
        paths[digest] = named_file(each, diagram.path)
    variant = diagram.variant or ""
    bundle = ApplicationBundle(
        name or "-".join(filter(None, (diagram.name, variant))),
        variant,
        diagram.resolved,
        (home / diagram.path.name).as_posix(),
        files,
        sources_of(diagram),
        diagram.hash,
        __version__,
        dict(diagram.ports),
        {
            each: [[list(target) for target in knob.targets], list(knob.elsewhere)]
            for each, knob in diagram.knobs.items()
        },
        engine,
        tuple(computers),
    )
    return ApplicationBundle.read(bundle.plain()), paths


def _check_code(diagram: Diagram) -> None:
    """Refuse a diagram with code that no target takes: that of blocks beside it, or of an FMU."""
    for node in diagram.graph.nodes:
        if type(node.block).__module__.startswith(OWN_MODULES):
            problem = f"block '{node.path}' is of the code beside the diagram, which no target takes"
            raise QuadvisError(f"{problem}; install {node.kind} there and here as a library")
        if node.block.brings_code:
            name = Path(getattr(node.block, node.block.brings_code)).name
            problem = f"block '{node.path}' runs the machine code of {quoted(name)}, which no target takes"
            raise QuadvisError(f"{problem}; fly it with 'quadvis run FILE --real-time'")


def _listed(diagram: Diagram) -> Mapping[str, str]:
    """Return the SHA-256 of the files that the resolved diagram lists, by the names that it gives them."""
    from quadvis.diagram.sections.files import FILES

    return FILES.resolved(diagram) or {}


def _above(name: str) -> int:
    """Return how many folders above the diagram a file lies."""
    parts = PurePosixPath(os.path.normpath(name)).parts
    return next((index for index, part in enumerate(parts) if part != ".."), len(parts))


def _last_parts(folder: Path, count: int) -> PurePosixPath:
    """Return the names of the last folders of a path."""
    return PurePosixPath(*Path(os.path.realpath(folder)).parts[-count:] if count else ())
