"""Explain exceptions of Python and of libraries in words for the user.

The explanation depends on the exception's type and number and on free memory, never on a library's phrases.
"""

from __future__ import annotations

import errno
import math
import os
import sys
from collections.abc import Callable

from quadvis.errors import OutOfRange, quoted
from quadvis.machine.files import reason

ROOM = 1 << 28  # bytes; if so much cannot be allocated, lack of memory is the cause of a failure
LONGEST = 200  # characters that are quoted from a library's message
OPENCV_NO_MEMORY = -4
_PERHAPS = (
    ImportError,
    RuntimeError,
    SystemError,
)  # raised by a library that does not fit into memory, or a thread that does not start
_NEVER = (ModuleNotFoundError, NotImplementedError, RecursionError)
MEMORY = "there is not enough memory; free some, or raise the limit (ulimit -v)"


def surroundings(error: BaseException) -> str:
    """Return which part of the surroundings failed, or "" if the cause is elsewhere."""
    if isinstance(error, MemoryError) or (isinstance(error, Exception) and is_short_of_memory(error)):
        return MEMORY
    if isinstance(error, RecursionError):
        return "this is nested too deeply, or calls itself without end"
    if isinstance(error, OSError):
        return _refused(error)
    if isinstance(error, ImportError):
        return f"{error.name or 'a library'} cannot be loaded: {one_line(error)}"
    if isinstance(error, UnicodeError):
        return f"a text holds characters that cannot be read or written: {one_line(error)}"
    return ""


def arithmetic(error: Exception) -> str:
    """Return which calculation has no finite result, or "" if the error is no failed calculation."""
    if isinstance(error, OutOfRange):
        return str(error)
    if isinstance(error, ZeroDivisionError):
        return "a division by zero"
    if isinstance(error, OverflowError):
        return "a number grew too large"
    if isinstance(error, FloatingPointError):
        return "a calculation gave no finite number"
    linalg = sys.modules.get("numpy.linalg")
    if linalg is not None and isinstance(error, linalg.LinAlgError):
        return "a matrix has no inverse or factors"
    if type(error) is ValueError and error.args in _DOMAIN:
        return "a function was asked for a value that it does not have, such as the root of a negative number"
    return ""


def one_line(error: BaseException) -> str:
    """Return the first line of an error or of its cause; the text of a failed import can fill a page."""
    while isinstance(error.__cause__, Exception):
        error = error.__cause__
    lines = [line for line in map(str.strip, str(error).splitlines()) if line]
    return (lines[0] if lines else type(error).__name__)[:LONGEST]


def is_short_of_memory(error: Exception) -> bool:
    """Return whether lack of memory caused an error; libraries report it in many ways."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    if getattr(error, "code", None) == OPENCV_NO_MEMORY:
        return True
    if isinstance(error, _NEVER) or not isinstance(error, _PERHAPS):
        return False
    try:
        from mmap import mmap  # a library of its own, which may not fit either

        mmap(-1, ROOM).close()
    except (ImportError, OSError, MemoryError):
        return True
    return False


def _refused(error: OSError) -> str:
    if isinstance(error, FileNotFoundError) and _folder_is_gone():
        return "the current folder is gone; change to one that exists"
    if isinstance(error.filename, str | bytes):
        return f"cannot use {quoted(os.fsdecode(error.filename))}: {reason(error)}"
    return f"the system refused: {reason(error)}"


def _folder_is_gone() -> bool:
    try:
        os.getcwd()
    except OSError:
        return True
    return False


def _arguments(function: Callable[[float], object], value: float) -> tuple[object, ...]:
    """Return the arguments of Python's error for a function without a value."""
    try:
        function(value)
    except ValueError as error:
        return error.args
    raise AssertionError("the function has no value there")


_DOMAIN = (_arguments(math.sqrt, -1.0), _arguments(int, math.nan))
