"""Loading: a diagram and all that its file names, checked, with every fault at once."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from quadvis.diagram.assembly import Assembly
from quadvis.diagram.bases import read_diagram, standing
from quadvis.diagram.diagram import Diagram
from quadvis.diagram.loader import read_text
from quadvis.diagram.settings import Files, Given, read_settings, setting_texts
from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError
from quadvis.errors.discretion import quoting_only
from quadvis.library.catalogue import OwnBlocks
from quadvis.machine.garbage import uncollected
from quadvis.machine.inputs import noted_inputs
from quadvis.machine.shipped import named_file, shipped_folder


def load(
    path: str | Path,
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    stop_time: str | float | None = None,
    seed: int | None = None,
    own_blocks: OwnBlocks = True,
) -> Diagram:
    """Load and check a diagram; DiagramError has all its faults.

    ``settings`` replace parameters: ``{"control/roll.bandwidth": "2.5 rad/s"}``, or texts
    ``control/roll.bandwidth=2.5 rad/s``; a name without a dot is a parameter of the diagram. ``params`` are
    parameter files, which hold such settings; they apply in their order, before ``settings``. ``stop_time``
    (s, or a text such as "20 s") and ``seed`` replace the diagram's.

    Loading runs the Python code of the blocks in the folder ``blocks`` beside the diagram.
    ``own_blocks=False`` refuses those; a function is called with that folder before the first of them is run.
    """
    faults = Faults()
    texts = setting_texts(settings)
    with quoting_only(_quotable(path, params, texts)), _reported_once(faults) as digests:
        given, files = read_settings(settings, params, faults)
        spec = read_diagram(named_file(path), faults)
        diagram = Assembly(spec, faults, files, own_blocks).diagram(variant, given, stop_time, seed)
        found = tuple(sorted(set(faults.warnings)))
        return replace(
            diagram, parameter_files=files, settings=texts, warnings=found, files=digests,
            own_blocks=bool(own_blocks),
        )  # fmt: skip


def draw_with_faults(
    path: str | Path,
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    own_blocks: OwnBlocks = True,
    part: str = "",
    depth: int | None = None,
) -> tuple[str, DiagramError]:
    """Return a picture of a diagram that has faults, as SVG, and all its faults.

    DiagramError if so little can be read that there is nothing to draw. The arguments are those of `load`.
    """
    from quadvis.diagram.sketch import draw_faulty

    faults = Faults()
    assembly = None
    try:
        with quoting_only(_quotable(path, params, setting_texts(settings))), _reported_once(faults):
            given, files = read_settings(settings, params, faults)
            assembly = Assembly(read_diagram(named_file(path), faults), faults, files, own_blocks)
            assembly.diagram(variant, given)
    except DiagramError as error:
        if assembly is None or not assembly.flat:
            raise
        return draw_faulty(assembly, error.faults, part=part, depth=depth), error
    raise QuadvisError(f"'{path}' has no faults")


def load_text(
    text: str,
    folder: str | Path = ".",
    name: str = "diagram.yaml",
    own_blocks: OwnBlocks = True,
    settings: Given = (),
) -> Diagram:
    """Load a diagram from a text, such as the resolved one in a log, as if it stood in a file of a folder.

    ``settings`` and ``own_blocks`` are those of `load`.
    """
    faults = Faults()
    texts = setting_texts(settings)
    with quoting_only(_quotable(Path(folder) / name, (), texts)), _reported_once(faults) as digests:
        given, _ = read_settings(settings, (), faults)
        spec = standing(read_text(text, Path(folder) / name, faults), faults)
        diagram = Assembly(spec, faults, own_blocks=own_blocks).diagram(settings=given)
        return replace(diagram, settings=texts, files=digests, own_blocks=bool(own_blocks))


def check(
    path: str | Path, settings: Given = (), params: Files = (), own_blocks: OwnBlocks = True
) -> Diagram:
    """Load a diagram, and with each of its variants in turn; DiagramError has the faults of all of them."""
    faults = Faults()
    quotable = _quotable(path, params, setting_texts(settings))
    with quoting_only(quotable), _reported_once(faults) as digests:
        given, files = read_settings(settings, params, faults)
        spec = read_diagram(named_file(path), faults)
        assembly = Assembly(spec, faults, files, own_blocks)
        diagram = assembly.diagram(settings=given)
        for variant in assembly.variants:
            assembly.diagram(variant)
        assembly.warn_unused()
        return replace(diagram, warnings=tuple(sorted(set(faults.warnings))), files=digests)


def _quotable(path: str | Path, params: Files, settings: Sequence[str]) -> Iterator[str | Path]:
    """Yield what faults may quote: the folders of the diagram and of quadvis's own, what the user named."""
    yield shipped_folder()
    for file in (path, *([params] if isinstance(params, str | os.PathLike) else params)):
        yield Path(file).parent
        yield Path(os.path.realpath(file)).parent
    yield from (setting.partition("=")[2].strip() or "." for setting in settings)


@contextmanager
def _reported_once(faults: Faults) -> Iterator[Mapping[str, str]]:
    """Raise the faults found inside, and yield the SHA-256 of every file that is read inside, by path.

    One cause may be met from several blocks: its place and problem are the same.
    """
    try:
        with uncollected(), noted_inputs() as digests:
            yield digests
        faults.check()
    except DiagramError as error:
        kept: dict[tuple[Place, str, str], Fault] = {}
        for fault in error.faults:
            subject = "" if fault.place.line or fault.place.column else fault.subject
            kept.setdefault((fault.place, fault.problem, subject), fault)
        raise DiagramError(kept.values()) from None


def varied(diagram: Diagram, setting: str) -> Diagram:
    """Return a diagram, loaded again with one more parameter replaced: ``block.parameter=value``."""
    params, settings = [file.path for file in diagram.parameter_files], (*diagram.settings, setting)
    return load(
        diagram.path, variant=diagram.variant, settings=settings, params=params, seed=diagram.seed,
        own_blocks=diagram.own_blocks,
    )  # fmt: skip
