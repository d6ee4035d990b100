"""Files that come with quadvis: `quadvis:calib/camera.yaml` names one, wherever quadvis is installed."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

PREFIX = "quadvis:"


@cache
def shipped_folder() -> Path:
    """Return the folder of the diagrams of quadvis: in its package, or in a checkout beside it."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "diagrams"
    return installed if installed.is_dir() else package.parent / "diagrams"


def named_file(text: str, file: str | os.PathLike[str] = "") -> Path:
    """Return the file that a text in a file names: a shipped one, or one relative to the file's folder."""
    if text.startswith(PREFIX):
        return shipped_folder() / text.removeprefix(PREFIX)
    return Path(file).parent / text


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
