"""An FMU that runs, in this process or in one of its own: requests, answers, and what went wrong."""

from __future__ import annotations

import json
import mmap
import os
import select
import signal
import struct
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from quadvis.errors import QuadvisError, sentence
from quadvis.fmi import exchange
from quadvis.fmi.exchange import END, FORGET, LENGTH, NUMBER, RESTORE, SAVE, TEXT, UnitSetup
from quadvis.fmi.instance import MOST_STATE, FmuInstance

START = 30.0  # s that an FMU has at least to be loaded and initialised
LEAVE = 1.0  # s that it has to end
AGAIN = (
    0.05  # s after which a caller that sleeps looks by itself: the byte that wakes it may have come too soon
)
ROOT = str(Path(__file__).parents[2])
PROGRAM = f"import sys; sys.path.insert(0, {ROOT!r}); from quadvis.fmi.worker import main; main()"
_BYTES = [bytes((number,)) for number in range(256)]
_LOOKS = range(500)  # at the answer, some 20 us
_STATUS, _SLEEPS = exchange.STATUS // exchange.SLOT, exchange.SLEEPS // exchange.SLOT
SIGNALS: dict[int, str] = {
    signal.SIGSEGV: "it used memory that is not its own",
    signal.SIGBUS: "it used memory that is not there",
    signal.SIGABRT: "it gave up by abort()",
    signal.SIGFPE: "it divided by zero",
    signal.SIGILL: "it has instructions that this processor does not know",
    signal.SIGKILL: "something killed it",
}


class FmuFault(QuadvisError):
    """An FMU that cannot go on: its status, or how its process ended, with its own message."""


class SavedFmu:
    """The whole state of an FMU at one instant: as bytes, or by a number in the memory of the FMU itself."""

    def __init__(self, owner: RunningFmu, data: bytes = b"", number: int = 0) -> None:
        self.owner, self.data, self.number = owner, data, number

    def __del__(self) -> None:
        if self.number:
            self.owner.forget(self.number)


class RunningFmu(Protocol):
    """An FMU between `open` and `close`. `ask` begins a request, `answer` waits until it is done.

    FmuFault, in a sentence, if the FMU cannot go on.
    """

    buffer: Any

    def open(self) -> None:
        """Load and initialise it."""

    def ask(self, request: int) -> None:
        """Begin a request; the one before is done."""

    def answer(self) -> None:
        """Wait until the request is done."""

    def save(self) -> SavedFmu:
        """Return the state at this instant."""

    def restore(self, saved: SavedFmu) -> None:
        """Go back to a state."""

    def forget(self, number: int) -> None:
        """Let a state in the memory of the FMU be freed at the next `save` or `restore`.

        Any thread may say so at any time, such as while a step is under way.
        """

    def close(self) -> None:
        """End it."""


class _Common:
    """What both ways to run an FMU share."""

    buffer: Any

    def __init__(self, setup: UnitSetup, folder: Path) -> None:
        self._setup, self._folder = setup, folder
        self._forgotten: list[int] = []

    def ask(self, request: int) -> None:
        """Begin a request."""
        raise NotImplementedError

    def answer(self) -> None:
        """Wait until it is done."""
        raise NotImplementedError

    def save(self) -> SavedFmu:
        """Return the state at this instant."""
        self._free()
        self.ask(SAVE)
        self.answer()
        if not self._setup.serialises:
            return SavedFmu(self, number=struct.unpack_from("q", self.buffer, NUMBER)[0])
        with open(self._folder / "state", "rb") as file:
            return SavedFmu(self, file.read(MOST_STATE))

    def restore(self, saved: SavedFmu) -> None:
        """Go back to a state."""
        self._free()
        if self._setup.serialises:
            (self._folder / "state").write_bytes(saved.data)
        elif saved.owner is not self:
            raise FmuFault(
                "the FMU keeps its states in its own memory; another instance cannot go back to them"
            )
        struct.pack_into("q", self.buffer, NUMBER, saved.number)
        self.ask(RESTORE)
        self.answer()

    def forget(self, number: int) -> None:
        """Let a state be freed later: nobody knows what is under way when Python finds it unused."""
        self._forgotten.append(number)

    def _free(self) -> None:
        while self._forgotten:
            struct.pack_into("q", self.buffer, NUMBER, self._forgotten.pop())
            self.ask(FORGET)
            with suppress(FmuFault):
                self.answer()

    def open(self) -> None:
        """Load and initialise it."""
        raise NotImplementedError

    def close(self) -> None:
        """End it."""
        raise NotImplementedError

    def _fault(self, status: int) -> FmuFault:
        """Return what a status means, with what the FMU has said."""
        (length,) = struct.unpack_from("q", self.buffer, LENGTH)
        raw = bytes(self.buffer[TEXT : TEXT + max(0, min(length, exchange.TEXT_ROOM))])
        return FmuFault(_sentence(status, " ".join(raw.decode("utf-8", "replace").split())))


class LocalFmu(_Common):
    """An FMU whose library is loaded into this process: what it does wrong ends this process, too."""

    def __init__(self, setup: UnitSetup, folder: Path) -> None:
        super().__init__(setup, folder)
        self.buffer = bytearray(setup.size)
        self._instance = FmuInstance(setup, self.buffer, str(folder))
        self._judged = self._instance.judged
        self._status = 0

    def open(self) -> None:
        """Load and initialise it."""
        if status := self._instance.open():
            raise self._fault(status)
        self._requests = self._instance.requests

    def ask(self, request: int) -> None:
        """Do a request: `FmuInstance.perform` without a call, which would be a tenth of a step."""
        status = self._requests[request]()
        self._status = self._judged(request, status) if status else 0

    def answer(self) -> None:
        """Look at how it went."""
        if self._status:
            raise self._fault(self._status)

    def close(self) -> None:
        """End it."""
        self._instance.end()


class IsolatedFmu(_Common):
    """An FMU in a process of its own. A request that is not done within ``deadline`` (s) ends it."""

    def __init__(self, setup: UnitSetup, folder: Path, deadline: float) -> None:
        super().__init__(setup, folder)
        self._deadline = deadline
        self._file = _shared_file(setup.size)
        self.buffer = mmap.mmap(self._file, setup.size)
        self._process: subprocess.Popen[bytes] | None = None
        self._ends: list[int] = [self._file]
        self._count = 0
        self._words = memoryview(self.buffer).cast("B")[: exchange.DATA].cast("q")
        self._asked = self._answered = -1

    def open(self) -> None:
        """Start the process, and have it load and initialise the FMU."""
        pipes = [os.pipe() for _ in range(3)]
        (asked, self._asked), (self._answered, answered), (life, held) = pipes
        theirs = (self._file, asked, answered, life)
        self._ends += [self._asked, self._answered, held]
        command = [sys.executable, "-I", "-S", "-c", PROGRAM, *map(str, theirs)]
        try:
            self._process = subprocess.Popen(
                command, pass_fds=theirs, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, start_new_session=True, cwd=self._folder,
            )  # fmt: skip
        except OSError as error:
            raise FmuFault(f"no process can be started for the FMU: {error.strerror}") from error
        finally:
            for end in (asked, answered, life):
                os.close(end)
        assert self._process.stdin is not None
        with suppress(BrokenPipeError), self._process.stdin as pipe:
            pipe.write(f"{json.dumps(self._setup.plain())}\n".encode())
        self._count = 1
        self._sleep(max(START, self._deadline))
        self.answer()

    def ask(self, request: int) -> None:
        """Begin a request."""
        self._count += 1
        try:
            os.write(self._asked, _BYTES[request])
        except BrokenPipeError:
            raise self._gone() from None

    def answer(self) -> None:
        """Wait until it is done: first with open eyes, since to be woken takes longer than most steps."""
        words, count = self._words, self._count
        for _ in _LOOKS:
            if words[0] == count:
                break
        else:
            self._sleep(self._deadline)
        if status := words[_STATUS]:
            raise self._fault(status)

    def _sleep(self, seconds: float) -> None:
        """Sleep until the request is done; FmuFault if that takes too long, or if the process has ended."""
        until, words = time.monotonic() + seconds, self._words
        poller = select.poll()  # `select.select` takes no descriptor above 1023
        poller.register(self._answered, select.POLLIN)
        words[_SLEEPS] = 1
        while words[0] != self._count:
            left = until - time.monotonic()
            if left <= 0.0:
                self._kill()
                raise FmuFault(f"the FMU did not answer within {seconds:g} s and was ended")
            ready = poller.poll(1000 * min(left, AGAIN))
            if ready and not os.read(self._answered, 64):
                raise self._gone()
        words[_SLEEPS] = 0

    def close(self) -> None:
        """End the process."""
        process = self._process
        if process is not None:
            with suppress(OSError):
                os.write(self._asked, bytes((END,)))
            with suppress(subprocess.TimeoutExpired):
                process.wait(LEAVE)
            self._kill()
        self._words.release()
        for end in self._ends:
            os.close(end)
        self._ends.clear()

    def _kill(self) -> None:
        assert self._process is not None
        with suppress(ProcessLookupError):
            self._process.kill()
        self._process.wait()

    def _gone(self) -> FmuFault:
        """Return how the process ended."""
        assert self._process is not None
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LEAVE)
        code = self._process.poll()
        if code is None:
            self._kill()
            return FmuFault("the FMU closed the line to its process")
        if code >= 0:
            return FmuFault(f"the FMU ended its process with the code {code}")
        return FmuFault(f"the FMU crashed: {SIGNALS.get(-code, f'signal {-code}')}")


def formatter() -> str:
    """Return the path of fmpy's library that formats messages of FMI 2.0; "" if fmpy is not there."""
    spec = find_spec("fmpy")
    for home in spec.submodule_search_locations or () if spec else ():
        name = {
            "linux": "linux64/logging.so",
            "darwin": "darwin64/logging.dylib",
            "win32": "win64/logging.dll",
        }
        path = Path(home) / "logging" / name.get(sys.platform, "")
        if path.is_file():
            return str(path)
    return ""


def _shared_file(size: int) -> int:
    """Return a file in memory that a process can hand on."""
    if hasattr(os, "memfd_create"):
        made = os.memfd_create("quadvis-fmu")
    else:
        with tempfile.TemporaryFile() as file:
            made = os.dup(file.fileno())
    os.ftruncate(made, size)
    return made


def _sentence(status: int, text: str) -> str:
    said = f": {text}" if text else ""
    if status == exchange.NO_LIBRARY:
        return f"the library of the FMU cannot be used{said}"
    if status == exchange.NO_INSTANCE:
        return f"the FMU refuses to make an instance{said}"
    if status == exchange.ENDING:
        return f"the FMU asks to end the simulation{said}"
    if status == exchange.EVENT:
        return sentence(
            "the FMU has an event, which model exchange here cannot handle", "take its co-simulation"
        )
    names = exchange.STATUS_NAMES
    return f"the FMU gave the status {names[status] if 0 <= status < len(names) else status}{said}"
