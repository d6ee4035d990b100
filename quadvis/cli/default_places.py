"""Where the outputs of a command go that are given no place: names of files, and the folder for them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError
from quadvis.machine.files import file_name, reason
from quadvis.machine.shipped import named_file

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram


def log_path(given: str | None, diagram: Diagram) -> Path | None:
    """Return the path of the log: the given path, or one in a folder that is made for logs."""
    if given is not None:
        return Path(given) if given else None
    from quadvis.output.log_place import claim_log
    from quadvis.run.session import metadata

    names = diagram.name, diagram.variant, *(file.name for file in diagram.parameter_files)
    return claim_log(runs_folder("log", "--log"), "-".join(filter(None, names)), metadata(diagram))


def default_name(options: argparse.Namespace, variant: str | None) -> str:
    """Return a name for the outputs of a diagram; it differs for other variants and parameter files."""
    stem = named_file(options.file).stem
    name = [file_name(stem) if set(stem) & set("+,") else stem, *([file_name(variant)] if variant else [])]
    return ",".join(("+".join(name), *(file_name(named_file(file).stem) for file in options.params)))


def runs_folder(what: str, option: str) -> Path:
    """Return the default folder for outputs, made if missing; `option` can name another place."""
    path = Path("runs")
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        problem = f"cannot make the folder '{path}' for the {what}: {reason(error)}"
        raise QuadvisError(f"{problem}; name another place with {option}") from error
    return path
