"""Target scopes on the terminal of the target: beside each other, one alone, and away when they are gone."""

from __future__ import annotations

import io
import os
import pty
import re
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadvis.host.target import Target
from quadvis.scopes.package import Package
from quadvis.scopes.settings import ScopeSettings
from quadvis.target.display import TargetDisplay
from quadvis.target.scopes import ShownScope
from tests.processes import linux, wait_for
from tests.quadvis.host.targets import LOOP, running_target

BRAILLE = re.compile("[\u2801-\u28ff]")


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True

    def rows(self) -> list[str]:
        """Return the lines of the newest picture, without what moves the cursor; begin anew."""
        text = self.getvalue()
        self.seek(0)
        self.truncate()
        return [re.sub(r"\x1b\[[0-9]*[A-Za-z]", "", line) for line in text.splitlines()]


def scope(number: int, name: str = "a.y", samples: int = 100) -> ShownScope:
    times = np.arange(samples) / 100
    values = np.sin(2 * np.pi * times).reshape(-1, 1)
    package = Package(number, 0, np.arange(samples), times, values, (name,), ("m",))
    return ShownScope(number, "Acquiring", ScopeSettings(Type="target", Signals=(name,)), package)


def display(said: list[str], lines: int = 40) -> tuple[TargetDisplay, Screen]:
    screen = Screen()
    return TargetDisplay(screen, said.append, lambda: (80, lines)), screen


def test_scopes_share_the_terminal_and_give_it_back() -> None:
    said: list[str] = []
    made, screen = display(said)
    made.say("before")
    made.show("lab", [], None)
    assert (said, screen.rows()) == (["before"], [])
    made.show("lab: loop is running, 1.0 s", [scope(1, "a.y"), scope(2, "b.y")], None)
    rows = screen.rows()
    assert rows[0] == "lab: loop is running, 1.0 s"
    assert [row for row in rows if row.startswith("scope")] == ["scope 1: Acquiring", "scope 2: Acquiring"]
    assert any("a.y" in row for row in rows) and any("b.y" in row for row in rows)
    assert len(BRAILLE.findall("".join(rows))) > 40 and len(rows) <= 40
    made.say("meanwhile")
    assert said == ["before"]
    made.show("lab: loop is running, 1.2 s", [scope(1), scope(2, "b.y")], 2)
    rows = screen.rows()
    assert [row for row in rows if row.startswith("scope")] == ["scope 2: Acquiring"]
    assert rows[-2] == "meanwhile"
    made.show("lab", [], None)
    assert said == ["before", "meanwhile"]
    made.say("after")
    assert said[-1] == "after"


def test_a_picture_is_written_when_something_has_changed() -> None:
    made, screen = display([])
    one = scope(3)
    made.show("lab", [one], None)
    assert screen.rows()
    made.show("lab", [one], None)
    assert not screen.rows()
    made.show("lab", [one._replace(status="Finished")], None)
    assert "scope 3: Finished" in screen.rows()


@pytest.mark.parametrize("lines", [3, 8, 12, 24])
def test_a_low_terminal_is_never_overfull(lines: int) -> None:
    made, screen = display([], lines)
    numerical = scope(9)
    numerical = numerical._replace(settings=replace(numerical.settings, Mode="numerical"))
    made.show("lab", [scope(1), scope(2), scope(3)._replace(package=None), numerical], None)
    assert len(screen.rows()) <= lines


@pytest.fixture
def terminal() -> Iterator[tuple[int, list[str]]]:
    """Give a terminal, and what is written to it."""
    master, slave = pty.openpty()
    found: list[str] = []

    def read() -> None:
        with suppress(OSError):
            while data := os.read(master, 65536):
                found.append(data.decode(errors="replace"))

    threading.Thread(target=read, daemon=True).start()
    yield slave, found
    os.close(slave)
    os.close(master)


@linux
@pytest.mark.slow
def test_a_target_in_a_terminal_shows_its_target_scopes(
    terminal: tuple[int, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slave, found = terminal
    path = tmp_path / "loop.yaml"
    path.write_text(LOOP)
    with running_target(screen=slave) as lab:
        for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, lab.environment[name])
        with Target("lab") as tg:
            tg.load(path).start()
            first = tg.addscope("target", signals=["wave.y"], NumSamples=20).start()
            second = tg.addscope("target", signals=["law.y"], NumSamples=10).start()
            wait_for(lambda: "law.y" in "".join(found) and len(BRAILLE.findall("".join(found))) > 40)
            text = "".join(found)
            assert "lab: loop is running" in text and f"scope {first.number}: " in text
            assert tg.ViewMode == "All"
            tg.ViewMode = second.number
            assert tg.view_mode == second.number
            found.clear()
            wait_for(lambda: f"scope {second.number}: " in "".join(found))
            found.clear()
            wait_for(lambda: f"scope {second.number}: " in "".join(found))
            assert f"scope {first.number}: " not in "".join(found)
            tg.ViewMode = "All"
            tg.remscope()
            tg.stop()
