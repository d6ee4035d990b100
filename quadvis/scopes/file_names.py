"""The names of the files of a file scope: in its folder, with a number in the place of %."""

from __future__ import annotations

import re

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.files import LONGEST

SUFFIX = ".mcap"
_PATTERN = re.compile(r"<(%+)>|(%+)")
_PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*")


class FileNames:
    """The names for a ``Filename``: "run.mcap", or "run_%%.mcap" for run_01.mcap to run_99.mcap.

    "<%%>", as xPC Target writes it, is the same. After the last number the first file is replaced. Without
    a name the files are called as those of xPC Target: SC1DATA.mcap for scope 1.
    """

    def __init__(self, filename: str, scope: int) -> None:
        """Read a name; QuadvisError if it is none of a file in the scope's folder."""
        text = filename or f"SC{scope}DATA{SUFFIX}"
        if not text.lower().endswith(SUFFIX):
            text += SUFFIX
        found = list(_PATTERN.finditer(text))
        if len(found) > 1:
            raise QuadvisError(f"the Filename {quoted(filename)} has two numbers; write % in one place")
        self._digits = len(found[0][1] or found[0][2]) if found else 0
        self._around = (text[: found[0].start()], text[found[0].end() :]) if found else (text, "")
        plain = "0".join(self._around) if found else text
        if not _PLAIN.fullmatch(plain) or ".." in plain or len(plain) + self._digits > LONGEST:
            remedy = f"use up to {LONGEST} letters, digits and _ - + . without a folder"
            raise QuadvisError(f"the Filename {quoted(filename)} is no name for a file; {remedy}")

    @property
    def many(self) -> bool:
        """Whether there is a name after the first."""
        return self._digits > 0

    def name(self, number: int) -> str:
        """Return the name of the file with a number, counted from 0."""
        if not self.many:
            return self._around[0]
        return f"{number % (10**self._digits - 1) + 1:0{self._digits}d}".join(self._around)
