"""The line of a user's source file in which an error arose."""

from __future__ import annotations

import inspect
import os
import sys
import traceback


def source_line(error: BaseException, source: str) -> str:
    """Return ``file:line`` of the innermost step of an error in a file, or in the files of a folder.

    "" if the error never was there.
    """
    whole = os.path.abspath(source)
    steps = [(step.filename, step.lineno) for step in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError):
        steps.append((error.filename or "", error.lineno))
    found = [
        (file, line) for file, line in steps if f"{os.path.abspath(file)}{os.sep}".startswith(whole + os.sep)
    ]
    return f"{shown(found[-1][0])}:{found[-1][1]}" if found else ""


def file_of(kind: type) -> str:
    """Return the file in which a class was written; "" if it was in none."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    if file is None:  # the module may be forgotten by now: the class knows by its methods
        bases = (base for base in kind.__mro__ if base.__module__ == kind.__module__)
        methods = (value for base in bases for value in vars(base).values() if inspect.isfunction(value))
        file = next((method.__code__.co_filename for method in methods), "")
    return str(file)


def shown(file: str) -> str:
    """Return a path as short as it is clear: from the current folder if it is in there."""
    try:
        short = os.path.relpath(file)
    except (OSError, ValueError):  # the current folder is gone, or on another drive
        return file
    return file if short.startswith(os.pardir) else short
