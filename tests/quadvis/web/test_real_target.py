"""Gateway and command in front of a target as it is: a process of its own that flies a loop in real time."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from quadvis.host.target import Target
from tests.processes import linux, wait_for
from tests.quadvis.host.targets import LOOP, running_target
from tests.quadvis.web.running import Running
from tests.quadvis.web.stand_in import StandIn

pytestmark = [linux, pytest.mark.slow]


def test_a_page_has_all_that_it_asks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    diagram = tmp_path / "loop.yaml"
    diagram.write_text(LOOP)
    with running_target() as lab:
        for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, lab.environment[name])
        with Target("lab") as tg:
            tg.load(diagram)
            running = Running(tg)
            try:
                with running.page() as page:
                    assert page.hello["level"] == 0 and page.hello["target"] == "lab"
                    assert page.request("start").startswith("loop")
                    wait_for(lambda: tg.ExecTime > 0.1)
                    assert "<svg" in page.request("drawing")
                    signals = {each["name"]: each for each in page.request("signals")}
                    assert signals["wave.y"]["unit"] == "m" and signals["wave.y"]["task"] == "fast"
                    page.request("watch", names=["wave.y", "law.y"])
                    first, second = (page.values()["wave.y"] for _ in range(2))
                    assert first != second
                    number = page.request("addscope")
                    page.request("setscope", id=number, values={"Signals": ["wave.y"], "NumSamples": 5})
                    page.request("listen", topics=[f"scope/{number}"])
                    page.request("startscope", ids=[number])
                    packages = [page.topic(f"scope/{number}") for _ in range(4)]
                    rows = np.concatenate([package["samples"] for package in packages])
                    assert np.allclose(rows[:, 1], np.sin(2 * np.pi * rows[:, 0]), atol=1e-6)
                    assert packages[0]["data"]["names"] == ["wave.y"] and packages[0]["data"]["parts"] == 1
                    found = page.request("setparam", values={"law.factor": "3"})
                    assert found["changes"] == [{"name": "law.factor", "old": 2.0, "new": 3.0}]
                    assert "lab refuses" in page.refused("setparam", values={"wave.frequency": "3 m"})
                    page.request("startprofiler")
                    wait_for(lambda: {"wave", "law"} <= timed_blocks(tg))
                    page.request("stopprofiler")
                    (timed,) = page.request("getprofilerdata")["blocks"]
                    assert {"wave", "law"} <= {each[0] for each in timed["methods"]}
                    state = page.topic("state")["data"]
                    (execution,) = {
                        tuple(each["execution"]) for each in state["Tasks"] if each["execution"] is not None
                    }
                    assert "histogram" in execution
                    page.request("stop")
                    (log,) = page.request("logs")
                    reply = page.reply(page.ask("getlog", name=log["name"], offset=0))
                    assert reply["payload"].startswith(b"\x89MCAP") and reply["result"]["size"] == log["size"]
                wait_for(lambda: tg.request("scopes") == [])  # the gateway removes what a page leaves
            finally:
                running.close()


def timed_blocks(tg: Target) -> set[str]:
    """Return the blocks of which the profiler has timed a call."""
    return {each.block for report in tg.getProfilerData().profiles.values() for each in report.methods}


def test_the_stand_in_says_what_a_target_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from quadvis.api import load

    diagram = tmp_path / "loop.yaml"
    diagram.write_text(LOOP)
    stand_in = StandIn(load(diagram), tmp_path)
    try:
        with running_target() as lab:
            for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
                monkeypatch.setenv(name, lab.environment[name])
            with Target("lab") as tg:
                tg.load(diagram).start()
                stand_in.do_start()
                wait_for(lambda: tg.ExecTime > 0.1 and stand_in.do_status()["ExecTime"] > 0.1)
                for verb in ("signals", "parameters", "scopes", "drawing"):
                    assert stand_in.request(verb) == tg.request(verb, deadline=60), verb
                assert tg.status().keys() >= stand_in.request("status").keys()
                names = ["wave.y", "law.y"]
                kinds = [
                    {name: type(value) for name, value in each.request("getsignal", names=names).items()}
                    for each in (stand_in, tg)
                ]
                assert kinds[0] == kinds[1]
    finally:
        stand_in.close()


def test_the_command_serves_until_ctrl_c(tmp_path: Path) -> None:
    with running_target() as lab:
        output = tmp_path / "output.txt"
        with output.open("w") as file:
            words = [sys.executable, "-m", "quadvis", "web", "--target", "lab", "--port", "0", "--no-browser"]
            process = subprocess.Popen(
                words, env=lab.environment, stdin=subprocess.DEVNULL, stdout=file, stderr=file
            )
        try:
            wait_for(lambda: re.search(r"http://127\.0\.0\.1:\d+/#\S{32}", output.read_text()))
            os.kill(process.pid, signal.SIGINT)
            assert process.wait(20) == 130
            assert "Traceback" not in output.read_text()
        finally:
            process.kill()
            process.wait()
