"""A server and clients over real sockets: requests, streams, the lease, and what each may see."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zmq

from quadvis.errors import QuadvisError
from quadvis.wire.client import Client
from quadvis.wire.courier import CONNECTED
from quadvis.wire.hosts import allow, revoke
from quadvis.wire.limits import CONNECTIONS
from quadvis.wire.messages import read_reply
from quadvis.wire.ports import HeldPath
from quadvis.wire.refusals import (
    BadError,
    BusyError,
    GoneError,
    NoAnswerError,
    NotAllowedError,
    RefusedError,
    UnknownError,
    WireError,
)
from quadvis.wire.server import Server
from tests.quadvis.wire.rig import Echo, Rig, after_loss, proxied, request, until


def test_a_host_asks_tunes_and_looks(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    assert anna.connect()["level"] == 0
    with pytest.raises(GoneError, match="needs the operator's lease"):
        anna.request("setparam", values={"a": 1.5})
    with anna.operating():
        assert anna.ask("setparam", values={"a": 1.5, "b": [1, 2.5]}).tick == 100
        assert anna.request("status")["operator"] == "anna"
    assert anna.request("status")["operator"] is None
    assert anna.request("getparam", names=["a", "b"]) == {"a": 1.5, "b": [1, 2.5]}
    with pytest.raises(UnknownError, match="lab1 refuses: there is no parameter 'c'"):
        anna.request("getparam", names=["c"])
    with pytest.raises(WireError, match="ZeroDivisionError"):
        anna.request("picture", signal="a")
    verbs = [json.loads(line)["verb"] for line in rig.audit.read_text().splitlines()]
    assert verbs == ["setparam", "lease", "setparam", "release"]


def test_the_client_refuses_a_wrong_argument_before_it_sends_it(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    for call in (
        lambda: anna.request("setparm"),
        lambda: anna.request("setparam", values={"a": float("nan")}),
    ):
        with pytest.raises((UnknownError, BadError)):
            call()
    assert rig.echo.calls == []


def test_answers_may_come_later_and_in_another_order(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    anna.operate()
    first, second = (anna.send("load", 20.0, application=name) for name in ("a", "b"))
    until(lambda: len(rig.echo.futures) == 2)
    assert anna.request("status")["Status"] == "stopped"
    rig.echo.futures[1].set_result("b")
    assert second.result(20).result == "b" and not first.done()
    rig.echo.futures[0].set_exception(QuadvisError("there is no application 'a'"))
    error = first.result(20).error
    assert isinstance(error, BadError) and "lab1 refuses: there is no application 'a'" in str(error)


def test_an_answer_that_does_not_come_in_time_is_a_sentence(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    anna.operate()
    with pytest.raises(BusyError, match=r"'load' is still under way after 0\.05 s"):
        anna.request("load", 0.05, application="a")


def test_streams_reach_those_who_may_see_them(rig: Rig) -> None:
    rig.key("anna", 3)
    rig.key("eve", 4)
    anna, eve = rig.client("anna"), rig.client("eve")
    assert not rig.server.wants("state")
    everything = anna.subscribe("state", "scope/1")
    assert rig.server.wants("state") and rig.server.wants("scope/1") and not rig.server.wants("scope/2")
    with pytest.raises(
        RefusedError, match=r"may see the status alone \(level 4\); the stream 'scope/1' needs"
    ):
        eve.subscribe("state", "scope/1")
    status = eve.subscribe("state")
    samples = np.arange(12.0).reshape(4, 3)
    rig.server.publish("scope/1", {"time": 0.5}, samples)
    rig.server.publish("state", {"Status": "running"})
    first, second = everything.take(20), everything.take(20)
    assert (first.topic, first.header) == ("scope/1", {"time": 0.5}) and (first.array == samples).all()
    assert second.header == {"Status": "running"} and second.array is None
    assert status.take(20).topic == "state"
    with pytest.raises(NoAnswerError):
        status.take(0.05)
    with pytest.raises(UnknownError):
        anna.subscribe("nothing")
    anna.unsubscribe(everything)
    with pytest.raises(GoneError):
        everything.take(1)
    until(lambda: not rig.server.wants("scope/1"))
    assert rig.server.wants("state")  # by eve


def test_a_key_that_is_lowered_or_revoked_sees_and_does_nothing_more(rig: Rig) -> None:
    pair = rig.key("anna", 0)
    rig.key("bob", 4)
    rig.server.lease.lasts = 1000.0  # it is withdrawn, and not lost by itself
    anna, bob = rig.client("anna"), rig.client("bob")
    scope, state = anna.subscribe("scope/1"), bob.subscribe("state")
    anna.operate()
    allow("anna", pair.public.hex(), 4, (), rig.target)
    with pytest.raises(RefusedError, match=r"may see the status alone \(level 4\)"):
        until(lambda: anna.request("getsignal", names=["a"]) and None)
    rig.server.publish("scope/1", {})
    rig.server.publish("state", {})
    assert state.take(20).number == 1  # what was published before it went to all who may see it
    with pytest.raises(NoAnswerError):
        scope.take(0.05)
    revoke("anna", rig.target)
    with pytest.raises(RefusedError, match="this key is let in no more"):
        until(lambda: anna.request("status") and None)
    until(lambda: rig.lost)
    assert rig.lost[0].name == "anna" and bob.request("status")["operator"] is None
    anna.close()
    with pytest.raises(NotAllowedError):
        rig.client("anna")


def test_a_key_is_let_in_from_its_networks_alone(rig: Rig) -> None:
    rig.key("anna", 0, ("10.0.0.0/8",))
    rig.key("bob", 0, ("127.0.0.0/8",))
    with pytest.raises(NotAllowedError, match="does not let in the key 'anna' from here"):
        rig.client("anna")
    assert rig.client("bob").request("hello")["key"] == "bob"
    assert any("turned away" in words for words in rig.said)


def test_one_operator_at_a_time_until_there_is_silence(rig: Rig) -> None:
    rig.key("anna", 0)
    rig.key("bob", 1)
    anna, bob = rig.client("anna"), rig.client("bob")
    lost: list[WireError] = []
    anna.operate(lost.append)
    with pytest.raises(BusyError, match="anna is the operator"):
        bob.operate()
    until(lambda: rig.server.counts["answered"] > 5)  # renewals go by themselves
    assert anna.operates and rig.lost == []
    anna._courier.close()  # as if the host had died
    until(lambda: rig.lost)
    bob.operate()
    assert bob.request("start")["verb"] == "start"
    assert any("the lease of anna is lost" in line for line in rig.audit.read_text().splitlines())


def test_the_lease_survives_a_short_loss_of_the_connection(rig: Rig, tmp_path: Path) -> None:
    rig.key("anna", 0)
    rig.server.lease.lasts = 60.0  # the machine may be busy
    with proxied(rig.port) as proxy:
        client = through(rig, proxy.port)
        with client:
            client.operate()
            proxy.cut()
            until(lambda: client._courier.state() != CONNECTED)
            after_loss(lambda: client.request("setparam", 20, values={"a": 1.0}))
            assert client.operates and rig.lost == []


def any_error(call: Callable[[], object]) -> bool:
    try:
        call()
    except WireError:
        return True
    return False


def through(rig: Rig, port: int) -> Client:
    from quadvis.wire.address import WireAddress
    from quadvis.wire.keys import own_key

    client = Client(WireAddress("127.0.0.1", port), "lab1", own_key("anna", rig.host), rig.pair.public)
    client.connect(20)
    return client


def test_a_request_is_not_sent_after_its_time(rig: Rig) -> None:
    rig.key("anna", 0)
    rig.server.lease.lasts = 1000.0
    with proxied(rig.port) as proxy, through(rig, proxy.port) as client:
        client.operate()
        proxy.close()
        until(lambda: client._courier.state() != CONNECTED)
        with pytest.raises(NoAnswerError):
            client.request("setparam", 0.1, values={"a": 1.0})
        client.send("setparam", 0.1, values={"a": 2.0}).cancel()
        kept = client.send("hello", 60)
        proxy.listen()
        assert kept.result(60).error is None
        assert client.request("getsignal", 20, names=["a"])["verb"] == "getsignal"
    assert rig.echo.values == {}


def test_a_host_that_comes_back_has_its_subscriptions_and_sees_the_gap(rig: Rig) -> None:
    rig.key("anna", 3)
    anna = rig.client()
    port = int(anna.request("hello")["stream"])
    with proxied(port) as proxy:
        anna.request = lambda cmd, *more, _ask=anna.request, **args: (  # type: ignore[method-assign]
            {"stream": proxy.port} if cmd == "hello" else _ask(cmd, *more, **args)
        )
        scope = anna.subscribe("scope/2")
        rig.server.publish("scope/2", {"n": 1})
        assert scope.take(20).number == 1
        proxy.cut()
        until(lambda: rig.server.counts["let in"] >= 3)
        numbers = [1]
        for _ in range(200):
            rig.server.publish("scope/2", {})
            try:
                numbers.append(scope.take(0.05).number)
                break
            except NoAnswerError:
                continue
    assert len(numbers) == 2 and scope.missed == numbers[1] - 2


def test_an_identity_of_ones_own_choice_is_not_heard(rig: Rig) -> None:
    pair = rig.key("anna", 0)
    with rig.raw(pair) as good, rig.raw(pair) as other:
        other.disconnect(f"tcp://127.0.0.1:{rig.port}")
        other.routing_id = b"anna"
        other.connect(f"tcp://127.0.0.1:{rig.port}")
        other.send(request("status"))
        until(lambda: rig.server.counts["malformed"] == 1)
        good.send(request("status", 5))
        assert read_reply(good.recv()).id == 5
        assert not other.poll(50)


@pytest.mark.parametrize("frames", [[b"", b"x"], [b"a", b"b", b"c"]], ids=str)
def test_a_message_of_several_frames_is_not_answered(frames: list[bytes], rig: Rig) -> None:
    with rig.raw(rig.key("anna", 0)) as socket:
        socket.send_multipart(frames)
        socket.send(request("status", 5))
        assert read_reply(socket.recv()).id == 5
    assert rig.server.counts["malformed"] == 1


def test_there_is_room_for_a_number_of_connections(rig: Rig) -> None:
    pairs = [rig.key(f"host{n}", 4) for n in range(CONNECTIONS + 1)]
    sockets = []
    try:
        for pair in pairs[:CONNECTIONS]:
            sockets.append(rig.raw(pair))
            sockets[-1].send(request("status"))
            assert read_reply(sockets[-1].recv()).error is None
        with pytest.raises(BusyError, match="no room"):
            rig.client(f"host{CONNECTIONS}")
        assert rig.server.counts["no room"] >= 1
        sockets.pop().close()
        until(lambda: not any_error(lambda: rig.client(f"host{CONNECTIONS}")))
    finally:
        for socket in sockets:
            socket.close()


def test_a_target_of_this_computer_is_reached_by_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from quadvis.wire.meeting import meet

    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with Server("lab1", Echo()) as server:
        path = server.listen_here()
        server.start()
        assert (Path(path).parent.stat().st_mode & 0o777) == 0o700
        with meet("lab1") as here:
            assert here.request("hello")["level"] == 0
            state = here.subscribe("state")
            server.publish("state", {"Status": "stopped"})
            assert state.take(20).number == 1
        with Server("lab1", Echo()) as second, pytest.raises(QuadvisError, match="'lab1' runs already"):
            second.listen_here()
        assert Path(path).exists()
    assert list(Path(path).parent.iterdir()) == []
    with Server("lab1", Echo()) as third:
        third.listen_here()


def test_a_path_is_held_by_one_process_whoever_removes_it_meanwhile(tmp_path: Path) -> None:
    import fcntl

    path = str(tmp_path / "lab1")
    first = HeldPath(path, "lab1")
    with pytest.raises(QuadvisError, match="'lab1' runs already: it listens at"):
        HeldPath(path, "lab1")
    with open(f"{path}.lock") as late:  # by who has opened the file, and takes the lock when it is gone
        first.release()
        fcntl.flock(late, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert not first._is_ours(late.fileno())
        second = HeldPath(path, "lab1")
        with pytest.raises(QuadvisError, match="runs already"):
            HeldPath(path, "lab1")
    for socket in second.sockets:
        Path(socket).touch()
    second.release()
    assert list(tmp_path.iterdir()) == []


def test_an_open_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run").chmod(0o755)
    with Server("lab1", Echo()) as server, pytest.raises(QuadvisError, match="open to other users"):
        server.listen_here(str(tmp_path / "run" / "lab1"))


def test_nothing_listens_without_keys_but_on_the_loopback_by_wish() -> None:
    with Server("lab1", Echo()) as server:
        for host in ("0.0.0.0", "192.168.1.7", "::", ""):
            with pytest.raises(QuadvisError, match=r"listens at 127\.0\.0\.1 alone"):
                server.listen(host, 0, insecure=True)
        with pytest.raises(QuadvisError, match="needs a key"):
            server.listen("127.0.0.1", 0)
        port = server.listen("127.0.0.1", 0, insecure=True)
        server.start()
        with zmq.Context.instance().socket(zmq.DEALER) as plain:
            plain.linger, plain.rcvtimeo = 0, 20_000
            plain.connect(f"tcp://127.0.0.1:{port}")
            plain.send(request("hello"))
            assert read_reply(plain.recv()).result["level"] == 0


def test_ports_that_are_taken_are_a_sentence(rig: Rig) -> None:
    with Server("lab2", Echo()) as server, pytest.raises(QuadvisError, match="cannot listen at 127"):
        server.listen("127.0.0.1", rig.port, insecure=True)


def test_data_that_is_too_long_is_counted_and_ends_nothing(rig: Rig) -> None:
    rig.key("anna", 3)
    scope = rig.client().subscribe("scope/1")
    rig.server.publish("scope/1", {}, np.zeros(600_000))
    rig.server.publish("scope/1", {"n": 2})
    found = scope.take(20)
    assert (found.header, found.number, rig.server.counts["unsent"]) == ({"n": 2}, 2, 1)


def test_publishing_and_closing_work_from_any_thread(rig: Rig) -> None:
    rig.key("anna", 3)
    state = rig.client().subscribe("state", size=10_000)
    threads = [
        threading.Thread(target=lambda: [rig.server.publish("state", {}) for _ in range(200)])
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    numbers = [state.take(20).number for _ in range(600)]
    assert numbers == list(range(1, 601)) and state.missed == 0
    thread = threading.Thread(target=rig.server.close)
    thread.start()
    thread.join(20)
    assert not thread.is_alive()
    rig.server.publish("state", {})  # nobody hears it, and nothing breaks
