"""The common end of commands and tools: failures of the surroundings become a sentence and an exit code.

Such failures are no fault of a diagram: Ctrl-C, streams that are closed or full, a folder that was deleted,
too little memory, names that the system refuses. Each becomes one sentence on standard error and an exit
code, never a traceback. Other exceptions are faults of the program and pass through.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from quadvis.errors import QuadvisError
from quadvis.errors.caller import command_words
from quadvis.machine.failures import MEMORY, surroundings
from quadvis.machine.files import reason

FAILED, REFUSED, INTERRUPTED, PIPE_BROKEN = 1, 2, 130, 141
AGAIN = 0.01  # s until a dropped interruption is repeated

_ctrl_c = False  # True after Ctrl-C
_short_of_memory = False  # True after a command for which there was too little


class OutputError(QuadvisError):
    """Standard output takes no more: the text to print is lost, and nothing else."""

    exit_code = FAILED


def listen() -> None:
    """Note Ctrl-C from now on, and open any closed standard streams.

    A library may turn the interruption of its import into its own error; then `ended` still knows the cause.
    The number of a closed stream would go to the next file, such as a log, and printed text would go there.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # takes the lowest free number
    with suppress(ValueError):  # signals belong to the main thread
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # it may be ignored
            signal.signal(signal.SIGINT, _interrupt)
            sys.unraisablehook = _unraisable


def _interrupt(*_: object) -> None:
    global _ctrl_c
    _ctrl_c = True
    raise KeyboardInterrupt


def _unraisable(lost: Any) -> None:
    """Repeat an interruption that Python had to drop, such as in a callback or while it deletes an object."""
    if lost.exc_type is KeyboardInterrupt and hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, AGAIN)
    else:
        sys.__unraisablehook__(lost)


def ended(command: Callable[[], int], name: str = "", enough: int = PIPE_BROKEN) -> int:
    """Run a command and return its exit code; ``name`` stands before its sentences.

    ``enough`` is the exit code if the reader of the output has seen enough and has ended.
    """
    global _ctrl_c, _short_of_memory
    _ctrl_c = _short_of_memory = False
    with _streams(), command_words():
        try:
            code = _flushed(command)
        except BrokenPipeError:  # the reader, such as head, has ended
            _discard(1)
            return enough
        except BaseException as error:
            words, code = _ending(error)
            if not words:
                raise
            with suppress(QuadvisError, BrokenPipeError):
                sys.stdout.flush()
            prefix = f"{name}: " if name else ""
            print(f"{prefix}{words}", *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        return code


def leave(code: int) -> NoReturn:
    """End the process with an exit code.

    For lack of memory at once: an orderly end of Python would fail again and again, and print each time how.
    """
    if _short_of_memory:
        os._exit(code)
    raise SystemExit(code)


def _flushed(command: Callable[[], int]) -> int:
    """Run a command, flush its output, and return its exit code."""
    try:
        code = command()
    except SystemExit:  # by --help, whose text may not be flushed yet
        sys.stdout.flush()
        raise
    sys.stdout.flush()
    return code


def _ending(error: BaseException) -> tuple[str, int]:
    """Return the sentence for an exception, and the exit code; "" if the exception is not for the user."""
    if isinstance(error, KeyboardInterrupt) or (_ctrl_c and isinstance(error, Exception)):
        return "interrupted", INTERRUPTED
    if isinstance(error, QuadvisError):
        return str(error), error.exit_code
    global _short_of_memory
    words = surroundings(error)
    _short_of_memory = words == MEMORY
    return words, FAILED if words == MEMORY else REFUSED


@contextmanager
def _streams() -> Iterator[None]:
    """Let standard output report, and standard error ignore, text that they cannot take."""
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout = _Stream(before[0] or nowhere, 1)
        sys.stderr = _Stream(before[1] or nowhere, 2)
        _calm()
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before


def _calm() -> None:
    """Show warnings of libraries even if PYTHONWARNINGS would turn them into errors."""
    if any(option.startswith("e") for option in sys.warnoptions):
        import warnings

        warnings.simplefilter("default")


def _discard(descriptor: int) -> None:
    """Discard the unwritten text of a stream; Python would complain about it at its end."""
    with suppress(AttributeError, OSError, ValueError):
        stream = sys.stdout if descriptor == 1 else sys.stderr
        number = stream.fileno()  # it differs from the descriptor if output is captured, as in a test
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)
        os.close(nowhere)


class _Stream:
    """A text stream whose errors are sentences; those of standard error are dropped, as nobody reads them."""

    def __init__(self, stream: Any, descriptor: int) -> None:
        self._stream, self._descriptor = stream, descriptor
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(
                errors="backslashreplace"
            )  # a name may hold characters unknown to the terminal

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text; OutputError if standard output does not take it."""
        return self._guarded(self._stream.write, text) or len(text)

    def flush(self) -> None:
        """Hand all text on; OutputError as for `write`."""
        self._guarded(self._stream.flush)

    def _guarded(self, method: Callable[..., Any], *arguments: str) -> Any:
        try:
            return method(*arguments)
        except OSError as error:
            if self._descriptor == 1 and isinstance(error, BrokenPipeError):
                raise
            _discard(self._descriptor)
            if self._descriptor == 1:
                raise OutputError(f"cannot write to standard output: {reason(error)}") from error
