"""A client that asks the gateway of a target for what the live page asks for, and measures how old it is."""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError

SIGNALS = 20
RATE = 200  # Hz
PACKAGE = 0.05  # s of samples in a package of the page's scope
NAMES = [f"ramp{number}.y" for number in range(1, SIGNALS + 1)]
# A signal says by its value which time it is of.
DIAGRAM = "\n".join(
    [
        "quadvis: 1",
        "name: shown",
        f"rates: {{fast: {RATE} Hz}}",
        "stop_time: 100000 s",
        "overload: {max: 100000000, consecutive: 100000000, action: warn}",
        "blocks:",
        *(
            f"  ramp{number}: {{block: sources.ramp, rate: fast, with: {{slope: 1 s/s}}}}"
            for number in range(1, SIGNALS + 1)
        ),
    ]
)


@dataclass
class Ages:
    """How old something is that comes again and again: when it came, and of which time it is (s)."""

    came: list[float] = field(default_factory=list)
    of: list[float] = field(default_factory=list)

    def add(self, of: float) -> None:
        """Note that something has come."""
        self.came.append(time.monotonic())
        self.of.append(of)

    def arrival(self) -> NDArray[np.float64]:
        """Return the ages at which it came (s)."""
        return np.array(self.came) - np.array(self.of)

    def shown(self) -> NDArray[np.float64]:
        """Return ages at moments that are 1 ms apart (s): what is shown ages until the next one comes."""
        moments = np.arange(self.came[0], self.came[-1], 1e-3)
        return moments - np.array(self.of)[np.searchsorted(self.came, moments, "right") - 1]


@contextmanager
def gateway(target: str) -> Iterator[tuple[int, str]]:
    """Serve the page of a target; give the process and the address."""
    words = [sys.executable, "-m", "quadvis", "web", "--target", target, "--port", "0", "--no-browser"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        if found is None:
            raise QuadvisError("the gateway does not start")
        yield process.pid, found[0]
    finally:
        process.terminate()
        process.communicate(timeout=20)


class PageClient:
    """A connection to a gateway, which answers beats as a page does that is in front."""

    def __init__(self, address: str, start: float) -> None:
        """Connect; ``start`` is the instant of the run's first tick on the monotonic clock (s)."""
        from websockets.sync.client import connect

        place, _, token = address.partition("#")
        host = place.removeprefix("http://").strip("/")
        self._stack = ExitStack()
        self._line = self._stack.enter_context(
            connect(f"ws://{host}/live", origin=f"http://{host}", compression=None, max_size=None, proxy=None)
        )
        self._line.send(json.dumps({"token": token}))
        self._number, self._start = 0, start
        self.values, self.samples = Ages(), Ages()
        self.missing = 0  # samples
        self._last = -1.0
        self._watched: Mapping[str, Any] = {}

    def request(self, verb: str, **arguments: Any) -> Any:
        """Return the result of a request; QuadvisError if it is refused."""
        self._number += 1
        self._line.send(json.dumps({"id": self._number, "verb": verb, "args": arguments}))
        while (found := self.take()).get("reply") != self._number:
            pass
        if not found["ok"]:
            raise QuadvisError(found["error"])
        return found["result"]

    def look(self) -> None:
        """Ask for all signals, as values and in a scope."""
        self.request("watch", names=NAMES)
        number = self.request("addscope")
        self.request("listen", topics=[f"scope/{number}"])
        count = round(PACKAGE * RATE)
        self.request("setscope", id=number, values={"Signals": NAMES, "NumSamples": count})
        self.request("startscope", ids=[number])

    def take(self) -> dict[str, Any]:
        """Take a message, and note how old it is."""
        message = self._line.recv(20)
        if isinstance(message, bytes):
            (length,) = struct.unpack_from("<I", message)
            found: dict[str, Any] = json.loads(message[4 : 4 + length])
            if found["topic"] == "values":
                self._take_values(found["data"], np.frombuffer(message[4 + length :]))
                return found
            times = np.frombuffer(message[4 + length :]).reshape(found["shape"])[:, 0]
            self.samples.add(self._start + times[-1])
            if self._last >= 0:
                self.missing += round((times[-1] - self._last) * RATE) - len(times) - found["data"]["lost"]
            self._last = times[-1]
            return found
        found = json.loads(message)
        if "beat" in found:
            self._line.send(json.dumps({"beat": found["beat"]}))
        elif found.get("topic") == "watched":
            self._watched = found["data"]
        return found

    def _take_values(self, header: Mapping[str, Any], numbers: NDArray[np.float64]) -> None:
        place = self._watched["names"].index(NAMES[0])
        if header["set"] == self._watched["set"] and place not in header["without"]:
            self.values.add(self._start + numbers[sum(self._watched["sizes"][:place])])

    def watch(self, seconds: float) -> None:
        """Take what comes for so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.take()

    def forget(self) -> None:
        """Begin the measurement anew."""
        self.values, self.samples, self.missing = Ages(), Ages(), 0

    def close(self) -> None:
        """End the connection."""
        self._stack.close()


def processor_time(process: int) -> float:
    """Return the processor time of a process, without its children but a target's porter (s)."""
    return sum((int(each[11]) + int(each[12])) / os.sysconf("SC_CLK_TCK") for each in _states(process))


def _states(process: int) -> list[list[str]]:
    """Return what the system says of a process, and of its porter if it is a target (proc(5), stat)."""
    return [
        Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        for each in (process, *porters(process))
    ]


def porters(process: int) -> list[int]:
    """Return the process that has the sockets of a target, if it is one."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == process and b"porter_process" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:  # it has ended
            continue
    return found


def memory(process: int) -> float:
    """Return the resident memory of a process, and of a target's porter (MB)."""
    return sum(int(each[21]) for each in _states(process)) * os.sysconf("SC_PAGESIZE") / 1e6
