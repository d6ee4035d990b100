"""Files that are named but cannot be read: what is there in their place, and what was meant."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Container

from quadvis.errors import closest, quoted

RELATIVE = "a path is relative to the file in which it stands"


def file_trouble(name: str, shown: str = "", but: Container[str] = ()) -> tuple[str, str]:
    """Return why there is no file to read under a name, and what would be right; nothing if there is one.

    ``shown`` is how the name was written, relative to another file. None of the real paths in ``but`` is
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
        return f"the file cannot be read: {system_reason(error)}", ""
    if stat.S_ISREG(mode):
        return "", ""
    if not stat.S_ISDIR(mode):
        return "this is not a file but a pipe or a device", "name a YAML file"
    return (missing, RELATIVE) if shown else ("this is not a file", "name a YAML file")


def system_reason(error: OSError | ValueError) -> str:
    """Return why the system refused a file; a name that it cannot hold raises ValueError."""
    return (error.strerror if isinstance(error, OSError) else None) or "embedded null byte"


def _near_file(name: str, shown: str, but: Container[str]) -> str:
    """Return the remedy for a file that is not there: other slashes, or a name that is close to it."""
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
    # What only ends alike is another file: the stem must be near, too.
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
