"""The diagrams and all that they name, as they come with quadvis, for `list` and `describe`."""

from __future__ import annotations

import itertools

from quadvis.errors import QuadvisError, suggestion
from quadvis.machine.shipped import PREFIX, named_file, shipped_folder

FOLDERS = ("textbook", "parts", "crafts", "calib", "protocols", "sets")
KINDS = ("*.yaml", *(f"{folder}/*.yaml" for folder in FOLDERS), "models/*.xml")


def shipped_names() -> list[str]:
    """Return the names of all files, as a diagram writes them: ``quadvis:parts/craft.yaml``."""
    folder = shipped_folder()
    files = [file for kind in KINDS for file in sorted(folder.glob(kind))]
    return [PREFIX + file.relative_to(folder).as_posix() for file in files]


def shipped_text(name: str) -> str:
    """Return the text of a file by its name; QuadvisError if there is none."""
    names = shipped_names()
    if name not in names:
        remedy = suggestion(name, names) or "quadvis list shows all"
        raise QuadvisError(f"there is no file '{name}'; {remedy}")
    return named_file(name).read_text(encoding="utf-8")


def shipped_texts() -> dict[str, str]:
    """Return the texts of all files by name."""
    return {name: named_file(name).read_text(encoding="utf-8") for name in shipped_names()}


def first_sentence(text: str) -> str:
    """Return the beginning of the comment at the top of a YAML or XML file."""
    if text.startswith("<!--"):
        lines = text.removeprefix("<!--").partition("-->")[0].splitlines()
    else:
        lines = [line[1:] for line in itertools.takewhile(lambda line: line[:1] == "#", text.splitlines())]
    comment = " ".join(" ".join(lines).split())
    return comment.split(". ")[0].split(": ")[0].removesuffix(".")
