"""Diagrams with seeded defects: each file in `cases/` holds many, with the reports that they must cause.

A file is a stream of YAML documents. `--- # prelude` opens the lines that every case begins with, unless it
begins with a key `quadvis` itself. `--- # case: title` opens a case; ` $ --set a.b=1` behind the title are
arguments of the command line. `--- # file: parts/leaf.yaml` opens a further file of the same case.

A fault is expected in the comment below its line, with a caret below its column (`#< ` for the first one):

    slow: {block: signal.derivitive}
    #             ^ block 'slow': there is no block 'signal.derivitive'; did you mean 'signal.derivative'?

`#! ` expects a fault of a whole file or of the command line, as it is printed.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

CASES = Path(__file__).parent / "cases"
_HEADER = re.compile(r"--- # (prelude|case: (?P<title>[^$]*?)(?: \$ (?P<arguments>.*))?|file: (?P<file>.*))")
_EXPECTED = re.compile(r"#(?:(?P<indent> *)\^|<) (?P<text>.*)")


@dataclass
class Case:
    """A diagram `case.yaml` and the files around it."""

    title: str
    arguments: list[str]
    files: dict[str, list[str]] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        """Write the files and return the diagram."""
        for name, lines in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return folder / "case.yaml"

    def expected(self) -> list[str]:
        """Return the faults as they are to be printed, with paths relative to the folder."""
        return sorted(text for name, lines in self.files.items() for text in _expected(name, lines))


def _expected(name: str, lines: list[str]) -> list[str]:
    found, last = [], 0
    for number, line in enumerate(lines, 1):
        match = _EXPECTED.fullmatch(line)
        if line.startswith("#! "):
            found.append(line[3:])
        elif match:
            column = 2 + len(match["indent"]) if match["indent"] is not None else 1
            found.append(f"{name}:{last}:{column}: {match['text']}")
        else:
            last = number
    return found


def read_cases(path: Path) -> list[Case]:
    """Return the cases of one file."""
    cases: list[Case] = []
    prelude: list[str] = []
    lines = prelude
    for line in path.read_text(encoding="utf-8").splitlines():
        header = _HEADER.fullmatch(line)
        if header is None:
            lines.append(line)
        elif header["title"]:
            lines = []
            cases.append(Case(header["title"], shlex.split(header["arguments"] or ""), {"case.yaml": lines}))
        elif header["file"]:
            lines = cases[-1].files[header["file"]] = []
    for case in cases:
        first = next((line for line in case.files["case.yaml"] if not line.startswith("#")), "")
        if not first.startswith("quadvis"):
            case.files["case.yaml"] = prelude + case.files["case.yaml"]
    return cases


def all_cases() -> list[Case]:
    """Return the cases of all files; their titles are unique."""
    return [case for path in sorted(CASES.glob("*.yaml")) for case in read_cases(path)]
