"""The process of a target: what systemd hears of it, what it starts by itself, and what it leaves."""

from __future__ import annotations

import os
import signal
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.host.target import Target
from quadvis.target.daemon import Daemon
from quadvis.target.notify import Notifier
from quadvis.wire import address
from quadvis.wire.refusals import NoAnswerError
from tests.processes import children, gone, linux, wait_for
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


def test_systemd_hears_of_a_target_that_takes_long_to_load_its_application(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with systemd(monkeypatch, 0.02) as heard:
        daemon = Daemon("lab", tmp_path, lambda words: None)
        loaded: Future[None] = Future()
        done: Future[None] = Future()
        done.set_result(None)
        monkeypatch.setattr(daemon.kernel, "load", lambda application: loaded)
        monkeypatch.setattr(daemon.kernel, "start", lambda at: done)
        thread = threading.Thread(target=daemon.start, args=["loop"])
        thread.start()
        wait_for(lambda: heard().count("WATCHDOG=1") >= 3)
        assert thread.is_alive()
        loaded.set_result(None)
        thread.join(20)
        with daemon:
            pass


def test_an_application_that_cannot_be_loaded_at_boot_is_a_sentence(tmp_path: Path) -> None:
    with (
        Daemon("lab", tmp_path, lambda words: None) as daemon,
        pytest.raises(QuadvisError, match="no application 'loop'"),
    ):
        daemon.start("loop")


def test_a_target_of_systemd_is_found_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory(prefix="q") as short:
        services = Path(short) / "services"
        monkeypatch.setattr(address, "SERVICES", services)
        monkeypatch.setenv("XDG_RUNTIME_DIR", f"{short}/user")
        monkeypatch.setenv("QUADVIS_HOME", f"{short}/home")
        monkeypatch.setenv("RUNTIME_DIRECTORY", f"{services}/lab:{short}/more")
        (services / "lab").mkdir(0o700, parents=True)
        with Daemon("lab", tmp_path, lambda words: None) as daemon:
            daemon.open(None)
            assert (services / "lab" / "lab").exists() and not (Path(short) / "user").exists()
            with Target("lab") as tg:
                assert tg.Status == "stopped"


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


@pytest.mark.faults
@pytest.mark.slow
def test_an_application_flies_on_when_the_porter_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    diagram = tmp_path / "loop.yaml"
    diagram.write_text(LOOP)
    with running_target("--folder", str(tmp_path / "kept")) as lab:
        for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, lab.environment[name])
        with Target("lab") as tg:
            tg.load(diagram)
            tg.start()
            wait_for(lambda: tg.ExecTime > 0.2)
            for how in (signal.SIGKILL, signal.SIGABRT):
                (porter,) = children(lab.process, b"porter_process")
                flown = tg.ExecTime
                os.kill(porter, how)
                wait_for(lambda porter=porter: gone(porter) and answers(tg))
                assert tg.Status == "running" and tg.ExecTime > flown
                words = f"has ended by {how.name}"
                assert words in lab.output
                assert words in (tmp_path / "kept" / "audit.jsonl").read_text()
            tg.stop()
            times = tg.getlog("TimeLog")  # of one run
            assert times[0] == 0 and times[-1] > flown
        (porter,) = children(lab.process, b"porter_process")
        lab.process.kill()
        wait_for(lambda: gone(porter))


def answers(tg: Target) -> bool:
    with suppress(NoAnswerError):
        return bool(tg.Status)
    return False


@pytest.mark.slow
def test_a_second_target_with_the_same_folder_is_refused(tmp_path: Path) -> None:
    kept = ("--folder", str(tmp_path))
    with running_target(*kept), running_target(*kept, name="other") as second:
        assert second.process.wait(20) == 2
        assert "the target other runs already, with the same folder" in second.output
