"""A run that is stopped at the helm leaves safe frames on its output ports, begun or not."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import quadvis
from tests.processes import wait_for
from tests.quadvis.realtime.ptys import Pty, ptys
from tests.quadvis.realtime.steered import Steered
from tests.quadvis.realtime.test_safe_ends import GOING, INITIAL, SAFE, write

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")]


@pytest.fixture
def pty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Pty]:
    monkeypatch.chdir(tmp_path)
    with ptys(1) as (made,):
        yield made


def frames(wire: bytes) -> list[bytes]:
    """Return the frames on a wire, each kind once."""
    return list(dict.fromkeys(wire[at : at + 25] for at in range(0, len(wire), 25)))


def test_a_run_that_is_stopped_ends_with_safe_frames(pty: Pty) -> None:
    write(pty.path)
    with Steered(quadvis.load("flight.yaml")) as steered:
        steered.reach("ready")
        wait_for(lambda: pty.read().endswith(INITIAL))
        assert frames(pty.read()) == [INITIAL]
        steered.helm.begin()
        wait_for(lambda: pty.read().endswith(2 * GOING))
        steered.helm.stop()
        result = steered.end()
    assert frames(pty.read()) == [INITIAL, GOING, SAFE] and pty.read().endswith(3 * SAFE)
    assert result.flight is not None and result.flight.early.startswith("it was stopped at t = ")


def test_a_run_that_is_stopped_before_its_start_ends_with_safe_frames(pty: Pty) -> None:
    write(pty.path)
    with Steered(quadvis.load("flight.yaml")) as steered:
        steered.reach("ready")
        steered.helm.stop()
        result = steered.end()
    assert frames(pty.read()) == [INITIAL, SAFE] and pty.read().endswith(3 * SAFE)
    assert result.flight is not None and result.flight.early == "it was stopped before its start"
