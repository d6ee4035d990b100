"""The process of a target: what systemd hears of it, what it starts by itself, and what it leaves."""

from __future__ import annotations

import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from quadvis.host.target import Target
from quadvis.target.notify import Notifier
from tests.processes import linux, wait_for
from tests.quadvis.host.targets import LOOP, running_target

pytestmark = linux


@contextmanager
def systemd(monkeypatch: pytest.MonkeyPatch, watchdog: float) -> Iterator[Callable[[], list[str]]]:
    """Listen in the place of systemd; give a function that returns all that was heard."""
    said: list[str] = []
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="q"))
        listener = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        listener.bind(f"{folder}/notify")
        listener.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", f"{folder}/notify")
        monkeypatch.setenv("WATCHDOG_USEC", str(int(watchdog * 1e6)))
        monkeypatch.delenv("WATCHDOG_PID", raising=False)

        def heard() -> list[str]:
            with suppress(BlockingIOError):
                while True:
                    said.append(listener.recv(100).decode())
            return said

        yield heard


def test_without_systemd_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"):
        monkeypatch.delenv(name, raising=False)
    notifier = Notifier()
    notifier.say("READY=1")
    assert notifier.period is None
    monkeypatch.setenv("WATCHDOG_USEC", "10000000")
    monkeypatch.setenv("WATCHDOG_PID", "1")  # it is for another process
    assert Notifier().period is None


@pytest.mark.slow
def test_a_target_starts_its_application_at_boot_and_leaves_no_socket(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    diagram = tmp_path / "loop.yaml"
    diagram.write_text(LOOP)
    kept = ("--folder", str(tmp_path / "kept"))
    with running_target(*kept) as lab:
        with monkeypatch.context() as patched:
            for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
                patched.setenv(name, lab.environment[name])
            with Target("lab") as tg:
                tg.load(diagram)
                tg.setparam("law.factor", 3.0)
                tg.saveparamset("mine")
                tg.setdefaultparamset("mine")
        assert (lab.folder / "quadvis" / "lab").exists()
        lab.process.terminate()
        assert lab.process.wait(20) in (0, 143)
        assert list((lab.folder / "quadvis").iterdir()) == []
    with systemd(monkeypatch, 0.4) as heard, running_target(*kept, "--startup", "loop") as lab:
        for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, lab.environment[name])
        with Target("lab") as tg:
            wait_for(lambda: tg.Status == "running" and tg.ExecTime > 0.2)
            assert (tg.Application, tg.DefaultParamSet, tg.getparam("law.factor")) == ("loop", "mine", 3.0)
        wait_for(lambda: heard().count("WATCHDOG=1") > 2)
        assert heard()[0] == "READY=1"
        lab.process.terminate()
        lab.process.wait(20)
        assert heard()[-1] == "STOPPING=1"


@pytest.mark.slow
def test_a_second_target_with_the_same_folder_is_refused(tmp_path: Path) -> None:
    kept = ("--folder", str(tmp_path))
    with running_target(*kept), running_target(*kept, name="other") as second:
        assert second.process.wait(20) == 2
        assert "the target other runs already, with the same folder" in second.output
