"""Explain why a named file cannot be read, and suggest the name that was meant."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Container
from pathlib import Path

from quadvis.errors import closest, quoted
from quadvis.machine.files import reason

MAX_BASES = 30  # of a file, its base, the base of that, and so on
RELATIVE = "a path is relative to the file in which it stands"


def file_trouble(name: str, shown: str = "", but: Container[str] = ()) -> tuple[str, str]:
    """Return why no file can be read under a name, and the remedy; ("", "") if the file can be read.

    ``shown`` is the name as it was written, relative to another file. Real paths in ``but`` are not
    suggested.
    """
    missing = f"there is no file '{shown}'" if shown else "there is no such file"
    try:
        mode = os.stat(name).st_mode
    except FileNotFoundError:
        return missing, _near_file(name, shown, but)
    except (OSError, ValueError) as error:
        if shown and getattr(error, "errno", None) in (errno.ENAMETOOLONG, errno.ENOTDIR):
            return missing, RELATIVE
        return f"the file cannot be read: {reason(error)}", ""
    if stat.S_ISREG(mode):
        return "", ""
    if not stat.S_ISDIR(mode):
        return "this is not a file but a pipe or a device", "name a YAML file"
    return (missing, RELATIVE) if shown else ("this is not a file", "name a YAML file")


def base_trouble(path: Path, text: str, users: tuple[str, ...]) -> tuple[str, str]:
    """Return the problem and the remedy for the base of a file; ``users`` are the real paths on top of it."""
    if os.path.realpath(path) in users:
        return f"'{text}' builds on itself", "name another file, or leave 'base' out"
    if len(users) > MAX_BASES:
        return f"files build on files more than {MAX_BASES} deep", "write their values into one"
    return file_trouble(str(path), text, users)


def _near_file(name: str, shown: str, but: Container[str]) -> str:
    """Return the remedy for a missing file: other slashes, or an existing file with a similar name."""
    written = shown or name
    if "\\" in written:
        slashed = written.replace("\\", "/")
        base = name[: len(name) - len(written)] if name.endswith(written) else ""
        there = ", which is there" if os.path.isfile(base + slashed) else ""
        return f"write '/' between folders: {quoted(slashed, 200)}{there}"
    if not written.isprintable():
        return "write '/' between folders, since '\\' and a letter are one sign in double quotes"
    folder, file = os.path.split(name)
    stem = os.path.splitext(file)[0]
    try:
        others = sorted(os.listdir(folder or "."))[:1000]
    except (OSError, ValueError):
        others = []
    # A name with only the same suffix is another file: the stem must be similar, too.
    stems = {
        other: os.path.splitext(other)[0]
        for other in others
        if other.endswith((".yaml", ".yml")) and os.path.realpath(os.path.join(folder, other)) not in but
    }
    near = closest(stem, stems.values())
    match = next((other for other, its_stem in stems.items() if its_stem == near), None)
    if match is None:
        return RELATIVE if shown else ""
    return f"did you mean {quoted(match if shown else os.path.join(folder, match), 200)}?"
