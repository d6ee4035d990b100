"""`quadvis bridge` in front of a target as it is: what arrives is what the log of the run has."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from quadvis.host.target import Target
from quadvis.output.log_reader import Log
from tests.processes import linux, wait_for
from tests.quadvis.bridge.scripted import FoxgloveClient
from tests.quadvis.host.targets import LOOP, Running, running_target

pytestmark = [linux, pytest.mark.slow]


@pytest.fixture(scope="module")
def lab() -> Iterator[Running]:
    with running_target() as found:
        yield found


@pytest.fixture
def tg(lab: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Target]:
    for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, lab.environment[name])
    with Target("lab") as found:
        diagram = tmp_path / "loop.yaml"
        diagram.write_text(LOOP)
        found.load(diagram)
        yield found
        found.unload()


@contextmanager
def bridge(lab: Running, folder: Path, *words: str) -> Iterator[Path]:
    """Run the command; yield the file with what it says. Ctrl-C ends it, and it leaves no scope."""
    output = folder / "output.txt"
    with output.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "quadvis", "bridge", *words, "--target", "lab"],
            env=lab.environment, stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True,
        )  # fmt: skip
    try:
        wait_for(lambda: "lab " in output.read_text() or process.poll() is not None)
        assert process.poll() is None, output.read_text()
        yield output
        os.kill(process.pid, signal.SIGINT)
        assert process.wait(20) == 130
        assert "Traceback" not in output.read_text()
    finally:
        process.kill()
        process.wait()


def placed(log: Log, name: str, stamps: list[int], began: int) -> list[float]:
    """Return the values that a log has of a signal at some stamps (ns since 1970)."""
    there = np.rint(log.times(name) * 1e9).astype(np.int64) + began
    places = np.searchsorted(there, stamps)
    assert there[places].tolist() == stamps
    return log[name][places].tolist()  # type: ignore[no-any-return]


def test_foxglove_sees_what_the_log_has(lab: Running, tg: Target, tmp_path: Path) -> None:
    with bridge(lab, tmp_path, "foxglove", "--port", "0", "--tune") as output:
        port = int(re.findall(r"ws://127\.0\.0\.1:(\d+);", output.read_text())[0])
        assert "tune parameters" in output.read_text()
        with FoxgloveClient.at(port) as client:
            client.until(lambda: {"/wave", "/law", "/other"} <= client.channels.keys())
            client.subscribe("/wave", "/law")
            client.until(lambda: len(tg.Scopes) == 2)
            began: list[int] = []
            tg.subscribe(f"scope/{tg.Scopes[0]}", lambda header, _: began.append(header["began"]))
            tg.start()
            client.until(lambda: len(client.messages.get("/law", [])) > 20)
            client.send("setParameters", parameters=[{"name": "law.factor", "value": 3}], id="set")
            client.until(lambda: "set" in client.answers)
            assert client.parameters["law.factor"] == 3.0 and tg.getparam("law.factor") == 3.0
            count = len(client.messages["/law"])
            client.until(lambda: len(client.messages["/law"]) > count + 20)
        tg.stop()
        log = tg.getlog()
        assert isinstance(log, Log)
        for name in ("wave", "law"):
            stamps = [stamp for stamp, _ in client.messages[f"/{name}"]]
            values = [struct.unpack("<4xd", data)[0] for _, data in client.messages[f"/{name}"]]
            assert placed(log, f"{name}.y", stamps, began[0]) == values
        steps = np.diff([stamp for stamp, _ in client.messages["/wave"]])
        assert np.median(steps) == 10_000_000  # some ticks may be left out, by a machine that is too busy
        assert log["law.y"][-1] == pytest.approx(
            3 * np.interp(log.times("law.y")[-1], log.times("wave.y"), log["wave.y"])
        )
    wait_for(lambda: tg.Scopes == [])


def test_plotjuggler_sees_what_the_log_has(lab: Running, tg: Target, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(60)
        to = f"127.0.0.1:{listener.getsockname()[1]}"
        with bridge(lab, tmp_path, "plotjuggler", "--to", to, "--signals", "law.y,wave.*"):
            wait_for(lambda: len(tg.Scopes) == 2)
            began: list[int] = []
            tg.subscribe(f"scope/{tg.Scopes[0]}", lambda header, _: began.append(header["began"]))
            tg.start()
            found: dict[str, list[tuple[float, float]]] = {}
            while len(found.get("law/y", [])) < 20:
                message = json.loads(listener.recv(2048))
                moment = message.pop("timestamp")
                for key, value in message.items():
                    found.setdefault(key, []).append((moment, value))
            tg.stop()
        log = tg.getlog()
        assert isinstance(log, Log)
        assert found.keys() == {"wave/y", "law/y"}
        for key, curve in found.items():
            # A float64 has the seconds since 1970 to 0.2 us, so the tick is the next one.
            ticks = [round((moment * 1e9 - began[0]) / 10_000_000) for moment, _ in curve]
            stamps = [began[0] + tick * 10_000_000 for tick in ticks]
            assert placed(log, key.replace("/", "."), stamps, began[0]) == [value for _, value in curve]
            assert (
                max(abs(moment - stamp / 1e9) for (moment, _), stamp in zip(curve, stamps, strict=True))
                < 1e-6
            )
    wait_for(lambda: tg.Scopes == [])
