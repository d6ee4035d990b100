"""Ctrl-C while a diagram flies on a target: the target stops, and the log comes home if there is one."""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from quadvis.api import load_text
from quadvis.cli.run_on_target import run_on_target

TEXT = """\
quadvis: 1
name: small
rates: {fast: 100 Hz}
stop_time: 1000 s
blocks:
  one: {block: sources.constant, rate: fast, with: {value: 1}}
"""


class FakeTarget:
    """A target whose user presses Ctrl-C at the start, when it is in a state."""

    def __init__(self, state: str) -> None:
        self.Status = state
        self.asked: list[str] = []

    def __enter__(self) -> FakeTarget:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def operator(self) -> Any:
        return nullcontext()

    def load(self, diagram: object, engine: str) -> None:
        self.asked.append("load")

    def start(self) -> None:
        raise KeyboardInterrupt

    def stop(self) -> None:
        self.asked.append("stop")

    def fetchlog(self, path: Path) -> Path:
        self.asked.append("log")
        return path


@pytest.mark.parametrize(
    ("state", "asked"),
    [
        ("ready", ["load"]),
        ("running", ["load", "stop", "log"]),
        ("stopping", ["load", "stop", "log"]),
        ("stopped", ["load", "log"]),
    ],
)
def test_ctrl_c_at_the_start_lets_no_target_fly_on(
    state: str, asked: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    target = FakeTarget(state)
    monkeypatch.setattr("quadvis.host.target.Target", lambda name: target)
    options = argparse.Namespace(target="lab", engine="auto", json=False)
    with pytest.raises(KeyboardInterrupt):
        run_on_target(load_text(TEXT), tmp_path / "a.mcap", options)
    assert target.asked == asked
