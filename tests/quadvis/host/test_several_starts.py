"""Several targets that are to begin together, of which one cannot."""

from __future__ import annotations

import time
from contextlib import nullcontext
from typing import Any

import pytest

from quadvis.api import load_text
from quadvis.errors import QuadvisError
from quadvis.host.several import Several

TEXT = """\
quadvis: 1
name: three
rates: {fast: 100 Hz}
stop_time: 1000 s
computers: {a: {}, b: {}, c: {}}
blocks:
  one: {block: sources.constant, rate: fast, at: a, with: {value: 1}}
  two: {block: sources.constant, rate: fast, at: b, with: {value: 1}}
  three: {block: sources.constant, rate: fast, at: c, with: {value: 1}}
"""


class FakeTarget:
    """A target whose start takes a while (s), or fails with an error."""

    def __init__(self, takes: float = 0.0, error: str = "") -> None:
        self._takes, self._error = takes, error
        self.Status = "ready"

    def operator(self) -> Any:
        return nullcontext()

    def request(self, verb: str, **arguments: Any) -> Any:
        if verb == "clock":
            return time.monotonic_ns()
        assert verb == "start"
        if self._error:
            raise QuadvisError(self._error)
        time.sleep(self._takes)
        self.Status = "running"
        return None

    def stop(self) -> None:
        self.Status = "stopped"


def test_where_one_cannot_start_none_flies_on_alone() -> None:
    targets = {"a": FakeTarget(error="the motors are gone"), "b": FakeTarget(), "c": FakeTarget(0.05)}
    with Several(load_text(TEXT), targets) as several:  # type: ignore[arg-type]
        with pytest.raises(QuadvisError, match="the motors are gone"):
            several.start()
        assert [target.Status for target in targets.values()] == ["ready", "stopped", "stopped"]
