"""The diagrams, parts, calibrations and parameter files that come with quadvis, for `list` and `describe`."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.errors import QuadvisError, suggestion
from quadvis.machine.columns import table
from quadvis.machine.shipped import PREFIX, named_file, shipped_folder

FOLDERS = ("", "parts", "calib", "sets")


def shipped_names() -> list[str]:
    """Return the names of all files, as a diagram writes them: ``quadvis:parts/craft.yaml``."""
    folder = shipped_folder()
    files = [file for inner in FOLDERS for file in sorted((folder / inner).glob("*.yaml"))]
    return [PREFIX + file.relative_to(folder).as_posix() for file in files]


def shipped_lines(width: int | None = None) -> list[str]:
    """Return one line for each file: its name, and the sentence with which it begins."""
    return table([(name, _first_sentence(shipped_text(name))) for name in shipped_names()], width)


def shipped_text(name: str) -> str:
    """Return the text of a file by its name; QuadvisError if there is none."""
    names = shipped_names()
    if name not in names:
        remedy = suggestion(name, names) or "quadvis list shows all"
        raise QuadvisError(f"there is no file '{name}'; {remedy}")
    return named_file(name).read_text(encoding="utf-8")


def _first_sentence(text: str) -> str:
    comment = " ".join(_comment(text))
    return comment.split(". ")[0].split(": ")[0].removesuffix(".")


def _comment(text: str) -> Iterator[str]:
    """Yield the lines of the comment at the top of a file."""
    for line in text.splitlines():
        if not line.startswith("#"):
            return
        yield line.removeprefix("#").strip()
