"""A part of a diagram as an FMU, with its source in C and its library for this machine."""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from quadvis.diagram.diagram import Diagram
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import MinorError
from quadvis.errors import QuadvisError
from quadvis.export.blocks import Announce, block_code
from quadvis.export.description_text import SOURCES, Facts, build_description, model_description
from quadvis.export.package import FMU, compiled, fmi_headers, library_suffix, packed, platform_folder
from quadvis.export.program_text import program_calls, program_header, undone_slots
from quadvis.export.selection import WHOLE, selected_blocks
from quadvis.export.variables import INPUT, OUTPUT, PARAMETER, ExportedVariable, variables_of
from quadvis.machine.files import PathLike, write_output

C = Path(__file__).parent / "c"
VERSIONS = (2, 3)
_SPACE = uuid.UUID("6d1e4f2a-9c1b-4f0e-8a53-0f3a6c7d2b11")  # of the tokens, which follow from the contents


@dataclass(frozen=True)
class ExportedFmu:
    """An FMU that was written: its variables by their names, and the step (s) at which its blocks run."""

    path: Path
    version: int
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    step: float


def export_fmu(
    diagram: Diagram,
    name: str,
    path: PathLike,
    *,
    version: int = 2,
    announce: Announce | None = None,
) -> ExportedFmu:
    """Write a part, a block, or "." for the whole of a diagram, as an FMU of FMI 2.0 or 3.0.

    QuadvisError, in a sentence, if it has blocks that cannot be written in C, if there is no C compiler, or
    if fmpy finds a problem in the FMU.
    """
    headers = fmi_headers(version)
    folder = platform_folder(version)
    selection = selected_blocks(diagram, name)
    engine = Engine(selection.graph, diagram.seed)
    named = variables_of(selection, engine)
    variables = _scalars(named) if version == 2 else named
    code = block_code(engine.program, [node.block for node in selection.graph.nodes], announce)
    undone, sizes = undone_slots(engine.program, selection.graph), _crossing_sizes(engine)
    sources = {
        "blocks.h": code.text,
        "calls.h": program_calls(engine.program, variables, undone, code.names, sizes),
        "model.h": (C / "model.h").read_text(encoding="utf-8"),
        **({"events.h": (C / "events.h").read_text(encoding="utf-8")} if sizes else {}),
        "steps.c": (C / "steps.c").read_text(encoding="utf-8"),
        f"fmi{version}.c": (C / f"fmi{version}.c").read_text(encoding="utf-8"),
    }
    facts = _facts(diagram, name, version, sources, float(engine.program.tasks[0].period))
    sources["program.h"] = program_header(engine.program, variables, undone, sizes, facts.token)
    library = facts.identifier + library_suffix()
    if announce:
        announce("compiling the FMU")
    binary = compiled({**headers, **sources}, SOURCES[version], library)
    files: dict[str, str | bytes] = {
        "modelDescription.xml": model_description(facts, variables),
        f"binaries/{folder}/{library}": binary,
        **{f"sources/{each}": text for each, text in {**sources, **headers}.items()},
    }
    if version == 3:
        files["sources/buildDescription.xml"] = build_description(facts)
    data = packed(files)
    _validate(data)
    write_output(path, FMU, data, diagram.inputs)
    roles = {
        role: tuple(each.name for each in named if each.role == role) for role in (INPUT, OUTPUT, PARAMETER)
    }
    return ExportedFmu(Path(path), version, roles[INPUT], roles[OUTPUT], roles[PARAMETER], facts.step)


def _crossing_sizes(engine: Engine) -> list[int]:
    """Return how many values the ``crossing`` of each block gives; none without a solver's step."""
    program, found = engine.program, list[int]()
    interpreter = engine.apart(program)
    for op in program.crossings if program.states else ():
        try:
            found.append(interpreter.crossing_size(op))
        except MinorError as failure:
            path = program.blocks[op.block].path
            problem = f"block '{path}' cannot be exported: its crossing fails at the start: {failure.error}"
            raise QuadvisError(problem) from failure
    return found


def _scalars(variables: Sequence[ExportedVariable]) -> list[ExportedVariable]:
    """Return one variable for each element, as FMI 2.0 wants it."""
    return [
        replace(variable, name=name, slots=(slot,), shape=(), start=(start,))
        for variable in variables
        for name, slot, start in variable.elements()
    ]


def _facts(diagram: Diagram, name: str, version: int, sources: Mapping[str, str], step: float) -> Facts:
    label = diagram.name if name == WHOLE else name
    text = re.sub(r"\W+", "_", label, flags=re.ASCII).strip("_")
    identifier = text if text[:1].isalpha() else f"m_{text}"
    digest = hashlib.sha256(repr((label, version, sorted(sources.items()))).encode()).hexdigest()
    token = f"{{{uuid.uuid5(_SPACE, digest)}}}"
    what = "the diagram" if name == WHOLE else f"'{name}' of the diagram"
    return Facts(version, label, f"{what} {diagram.name}", identifier, token, step, float(diagram.stop_time))


def _validate(data: bytes) -> None:
    """Refuse to hand out what fmpy finds a problem in."""
    import io

    from fmpy.validation import validate_fmu

    if problems := validate_fmu(io.BytesIO(data)):
        raise QuadvisError(f"fmpy finds a problem in the FMU: {problems[0]}")
