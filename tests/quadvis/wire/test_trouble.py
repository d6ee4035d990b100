"""Why a target does not answer: each reason has its own sentence and its own exit code."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.wire.address import WireAddress, read_address
from quadvis.wire.client import Client
from quadvis.wire.keys import fingerprint, made_pair, new_key
from quadvis.wire.known import KnownTargets
from quadvis.wire.meeting import meet
from quadvis.wire.ports import listeners
from quadvis.wire.refusals import NoAnswerError, NotAllowedError, WireError, WrongTargetError
from tests.quadvis.wire.rig import Rig


@pytest.fixture
def host(tmp_path: Path) -> Path:
    new_key("anna", tmp_path / "hosts")
    return tmp_path / "hosts"


@contextmanager
def silent_ports(*listening: int, answer: bytes = b"") -> Iterator[int]:
    """Hold three ports of which some accept and say at most one thing; yield the first."""
    made = listeners("127.0.0.1", 0)
    with ExitStack() as stack:
        for each in made:
            stack.enter_context(each)
        for number in listening:
            made[number].listen()
        if answer:
            made[1].setblocking(True)

            def say() -> None:
                while True:
                    try:
                        connection, _ = made[1].accept()
                    except OSError:
                        return
                    connection.sendall(answer)
                    connection.close()

            threading.Thread(target=say, daemon=True).start()
        yield int(made[0].getsockname()[1])
        for each in made:
            with ExitStack() as quiet:
                quiet.callback(each.close)
                with suppress(OSError):
                    each.shutdown(socket.SHUT_RDWR)


def refusal(target: str, host: Path, timeout: float = 1.5) -> WireError:
    with pytest.raises(WireError) as caught:
        meet(target, folder=host, timeout=timeout).close()
    return caught.value


def test_a_closed_port(host: Path) -> None:
    with silent_ports() as port:
        error = refusal(f"127.0.0.1:{port}", host)
    assert isinstance(error, NoAnswerError) and error.exit_code == 3
    assert f"does not answer: nothing answers at 127.0.0.1, port {port + 1} (connection refused)" in str(
        error
    )


def test_a_port_that_is_silent(host: Path) -> None:
    with silent_ports(0, 1, 2) as port:
        error = refusal(f"127.0.0.1:{port}", host)
    assert isinstance(error, NoAnswerError) and "is silent" in str(error)


@pytest.mark.parametrize("answer", [b"SSH-2.0-x\r\n", b"\x00" * 300, b"quadvis 1 ../a " + b"0" * 64 + b"\n"])
def test_a_port_of_something_else(answer: bytes, host: Path) -> None:
    with silent_ports(1, answer=answer) as port:
        error = refusal(f"127.0.0.1:{port}", host)
    assert isinstance(error, NoAnswerError) and "no target of quadvis" in str(error)


def test_a_target_that_introduces_itself_and_is_silent_then(host: Path) -> None:
    line = f"quadvis 1 lab1 {'ab' * 32}\n".encode()
    with silent_ports(0, 1, answer=line) as port:
        error = refusal(f"127.0.0.1:{port}", host)
    assert isinstance(error, NoAnswerError) and "is connected, and silent" in str(error)


def test_a_target_with_another_key(rig: Rig) -> None:
    rig.key("anna", 0)
    old = made_pair("lab1")
    KnownTargets(rig.host).pin("lab1", f"127.0.0.1:{rig.port}", old.public)
    error = refusal("lab1", rig.host)
    assert isinstance(error, WrongTargetError) and error.exit_code == 4
    assert fingerprint(old.public) in str(error) and fingerprint(rig.pair.public) in str(error)
    assert rig.server.counts["let in"] == 0


def test_a_target_that_shows_the_right_key_and_does_not_have_it(rig: Rig) -> None:
    """The introduction proves nothing: whoever only repeats a target's line cannot answer the handshake."""
    pair = rig.key("anna", 0)
    copied = made_pair("lab1").public
    address = WireAddress("127.0.0.1", rig.port)
    with Client(address, "lab1", pair, copied) as client, pytest.raises(WrongTargetError):
        client.connect(3)
    assert rig.echo.calls == []


def test_a_target_that_does_not_know_our_key(rig: Rig) -> None:
    pair = rig.key("anna", None)
    error = refusal(f"127.0.0.1:{rig.port}", rig.host, 20)
    assert isinstance(error, NotAllowedError) and error.exit_code == 5
    assert f"quadvis keys allow anna {pair.public.hex()} --level" in str(error)


def test_a_path_without_a_target(tmp_path: Path) -> None:
    error = refusal(str(tmp_path / "lab1"), tmp_path, 0.3)
    assert "nothing listens at" in str(error) and "quadvis target" in str(error)


def test_a_host_without_a_key(tmp_path: Path) -> None:
    with pytest.raises(QuadvisError, match="there is no key; make one with 'quadvis keys new NAME'"):
        meet("127.0.0.1", folder=tmp_path)


@pytest.mark.parametrize(
    "text", ["", "a b", "lab1:0", "lab1:99999", "lab1:x", "[::1", "udp://lab1", "a/../b:1"]
)
def test_a_wrong_address_is_refused(text: str) -> None:
    with pytest.raises(QuadvisError, match="is no address"):
        read_address(text)


def test_addresses_are_read() -> None:
    assert str(read_address("lab1")) == "lab1:22222"
    assert str(read_address("tcp://[fd00::1]:5")) == "[fd00::1]:5"
    assert read_address("ipc:///run/lab1").endpoint == "ipc:///run/lab1"


@pytest.mark.slow
def test_ctrl_c_ends_a_host_that_waits(host: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from quadvis.wire.meeting import meet\n"
        "print('begun', flush=True)\nmeet(sys.argv[1], folder=Path(sys.argv[2]), timeout=600)"
    )
    with silent_ports(0, 1, 2) as port:
        words = [sys.executable, "-c", script, f"127.0.0.1:{port}", str(host)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None and process.stdout.readline() == b"begun\n"
            process.send_signal(2)
            assert process.wait(60) != 0
            assert process.stderr is not None and b"KeyboardInterrupt" in process.stderr.read()
