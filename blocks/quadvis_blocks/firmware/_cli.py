"""Betaflight's command line: its settings, line by line, as `diff all` prints them."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from quadvis.block import ParameterError
from quadvis.errors import quoted, sentence
from quadvis_blocks.firmware._connection import FirmwareError, MspConnection

PROMPT = b"\n# "
ANSWER = 3.0  # s that a line may take
LOOK = 0.05  # s
LONGEST, MOST = 200, 2000  # characters of a line, and lines
ENDS = ("save", "exit", "bl", "reboot", "defaults", "batch")  # what ends the command line is our own business
REFUSAL = re.compile(r"###\s*ERROR(?:\s+IN\s+\w+)?:?\s*(.*?)\s*#*$", re.MULTILINE)


class SettingLine(NamedTuple):
    """A line for the command line, and where it stands; 0 for one of ours."""

    text: str
    number: int = 0


def read_settings(path: str) -> list[SettingLine]:
    """Return the lines of a file of settings without comments; ParameterError if one cannot be sent."""
    lines = Path(path).read_text("utf-8").splitlines() if path else []
    if len(lines) > MOST:
        raise ParameterError("settings", f"settings must be at most {MOST} lines, got {len(lines)}")
    found = []
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        place = f"settings must be lines of Betaflight's command line; line {number}"
        if len(text) > LONGEST or not (text.isascii() and text.isprintable()):
            raise ParameterError("settings", f"{place} is no such line")
        if text.split()[0].lower() in ENDS:
            raise ParameterError("settings", sentence(f"{place} is {quoted(text)}", "leave it out"))
        found.append(SettingLine(text, number))
    return found


def enter(connection: MspConnection, settings: Iterable[SettingLine]) -> None:
    """Enter settings and let the firmware save them, which ends it; FirmwareError names a line it refuses."""
    connection.write(b"#")
    _answer(connection, "the command line does not open")
    for setting in settings:
        connection.write(setting.text.encode() + b"\r\n")
        answer = _answer(connection, f"no answer to the setting {quoted(setting.text)}")
        refusal = REFUSAL.search(answer)
        if refusal:
            place = f"line {setting.number} of the settings, " if setting.number else "the setting "
            raise FirmwareError(f"{place}{quoted(setting.text)}, is refused: {refusal[1].lower()}")
    connection.write(b"save\r\n")


def _answer(connection: MspConnection, problem: str) -> str:
    """Return what is printed until the next prompt."""
    end, found = time.monotonic() + ANSWER, b""
    while not found.endswith(PROMPT):
        if time.monotonic() > end:
            raise FirmwareError(problem)
        found += connection.read(LOOK)
    return found.decode("ascii", "replace").replace("\r", "")
