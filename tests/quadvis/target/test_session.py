"""The end of a session, also where something fails as it ends."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from quadvis.api import load_text
from quadvis.errors import QuadvisError
from quadvis.target import session as module
from quadvis.target.application import Application
from quadvis.target.profiler import Profiler
from quadvis.target.session import Session

TEXT = """
quadvis: 1
name: small
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz}}
"""


def test_a_session_is_over_whatever_fails_as_it_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    def fail(*_: object, **__: object) -> Any:
        raise QuadvisError("a port is missing")

    def end() -> None:
        raise KeyError("what hears of the end fails")

    monkeypatch.setattr(module, "recorded", fail)
    monkeypatch.setattr(threading, "excepthook", lambda args: shown.append(str(args.exc_value)))
    diagram = load_text(TEXT, tmp_path)
    made = Session(
        diagram, "auto", tmp_path / "a.mcap", math.inf, Profiler(), [], None, shown.append, print, end
    )
    made.join()
    assert (made.running, made.problem) == (False, "a port is missing")
    with pytest.raises(QuadvisError, match="a port is missing"):
        made.ready.result(0)
    assert shown == ["'what hears of the end fails'"]


@pytest.mark.parametrize("error", [QuadvisError("the disk is full"), OSError("the disk is full")])
def test_values_that_cannot_be_kept_are_reported_and_the_scopes_end_all_the_same(error: Exception) -> None:
    told: list[str] = []

    def save(path: object) -> None:
        raise error

    application: Any = SimpleNamespace(
        _session=SimpleNamespace(problem="", result=None),
        parameters=SimpleNamespace(tuned=["a value"], save=save),
        name="small",
        scopes=SimpleNamespace(end=lambda: told.append("scopes")),
        _store=SimpleNamespace(set_path=lambda *_: Path()),
        _say=told.append,
        _event=lambda what, **_: told.append(what),
    )
    Application._ended(application)
    assert told == ["the values that were tuned are not kept: the disk is full", "scopes", "stopped"]
