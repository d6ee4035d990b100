"""The line of a user's source file in which an error arose."""

from __future__ import annotations

import os
import sys
import traceback


def source_line(error: BaseException, file: str) -> str:
    """Return ``file:line`` of the innermost step of an error in a source file; "" if it never was there."""
    whole = os.path.abspath(file)
    steps = traceback.extract_tb(error.__traceback__)
    lines = [step.lineno for step in steps if os.path.abspath(step.filename) == whole]
    if isinstance(error, SyntaxError) and os.path.abspath(error.filename or "") == whole:
        lines.append(error.lineno)
    return f"{shown(file)}:{lines[-1]}" if lines else ""


def file_of(kind: type) -> str:
    """Return the file in which a class was written; "" if it was in none."""
    return str(getattr(sys.modules.get(kind.__module__), "__file__", None) or "")


def shown(file: str) -> str:
    """Return a path as short as it is clear: from the current folder if it is in there."""
    try:
        short = os.path.relpath(file)
    except (OSError, ValueError):  # the current folder is gone, or on another drive
        return file
    return file if short.startswith(os.pardir) else short
