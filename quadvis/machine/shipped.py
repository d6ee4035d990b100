"""Files that come with quadvis: `quadvis:calib/camera.yaml` names one, wherever quadvis is installed."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

PREFIX = "quadvis:"
INSTALLED = Path(__file__).resolve().parents[1] / "diagrams"  # not there in a checkout


@cache
def shipped_folder() -> Path:
    """Return the folder of the diagrams of quadvis: in its package, or in a checkout beside it."""
    return INSTALLED if INSTALLED.is_dir() else INSTALLED.parents[1] / "diagrams"


def named_file(text: str | os.PathLike[str], file: str | os.PathLike[str] = "") -> Path:
    """Return the file that a text in a file names: a shipped one, or one relative to the file's folder."""
    name = os.fspath(text)
    if name.startswith(PREFIX):
        return shipped_folder() / name.removeprefix(PREFIX)
    return Path(file).parent / name


def named_output(text: str, file: str, diagram: Path) -> Path:
    """Return the file or folder to be written that a text in a file names.

    Nothing is written into an installation: a shipped file counts as if it stood in a folder ``diagrams``
    beside the diagram, or in the working directory if the diagram is a shipped one, too.
    """
    is_ours = is_shipped(diagram)
    if not is_shipped(file) or (is_ours and not INSTALLED.is_dir()):
        return named_file(text, file)
    inner = os.path.relpath(os.path.dirname(os.path.realpath(file)), os.path.realpath(shipped_folder()))
    beside = Path() if is_ours else diagram.parent
    return Path(os.path.normpath(beside / "diagrams" / inner / text))


def is_shipped(path: str | os.PathLike[str]) -> bool:
    """Return whether a file or folder is one of those that come with quadvis, or is in them."""
    return _below(os.path.realpath(path), os.path.realpath(shipped_folder()))


def portable_name(path: str | os.PathLike[str], folder: Path) -> str:
    """Return the text that names a file in a diagram of a folder, wherever the folder and quadvis are."""
    if is_shipped(path) and not is_shipped(folder):
        return PREFIX + Path(os.path.relpath(os.path.realpath(path), shipped_folder())).as_posix()
    return Path(os.path.relpath(path, folder)).as_posix()


def _below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder + os.sep)
