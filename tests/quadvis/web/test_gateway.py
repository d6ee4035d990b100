"""Who gets in, who does not, and what a page can do to the gateway and to other pages."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import threading
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from quadvis.api import load, load_text
from quadvis.errors import QuadvisError
from quadvis.web import gateway as gateways
from quadvis.web import listener, messages, viewer
from tests.quadvis.web.running import Running
from tests.quadvis.web.stand_in import StandIn

TEXT = """
quadvis: 1
name: small
rates: {fast: 100 Hz}
stop_time: 1000 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz}}
  gain: {block: signal.gain, rate: fast, with: {factor: 2}, in: {u: wave.y}}
"""


@pytest.fixture
def target(tmp_path: Path) -> Iterator[StandIn]:
    made = StandIn(load_text(TEXT, tmp_path), tmp_path)
    yield made
    made.close()


@pytest.fixture
def running(target: StandIn) -> Iterator[Running]:
    made = Running(target)
    yield made
    made.close()


def status_of(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1])


def waited_for(condition: object) -> bool:
    """Wait until a condition holds; what never happens fails by the limit of 20 s."""
    assert callable(condition)
    end = time.monotonic() + 20
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


# the page's files


def test_the_page_is_served_with_a_policy_that_lets_in_nothing_else(running: Running) -> None:
    head, _, body = running.get("/").partition(b"\r\n\r\n")
    assert status_of(head) == 200 and body.startswith(b"<!DOCTYPE html>")
    lines = head.decode().lower().splitlines()
    assert "x-content-type-options: nosniff" in lines
    (policy,) = [line for line in lines if line.startswith("content-security-policy")]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "frame-ancestors 'none'" in policy
    assert not any(line.startswith("server:") for line in lines)


def test_every_file_that_the_page_names_is_served(running: Running) -> None:
    import re

    from quadvis.web.files import FOLDER

    named = set(re.findall(r'(?:href|src)="([^"]+)"', (FOLDER / "index.html").read_text(encoding="utf-8")))
    for path in FOLDER.glob("*.js"):
        named |= set(re.findall(r'from "\./([^"]+)"', path.read_text(encoding="utf-8")))
    assert len(named) >= 20
    preloaded = set(re.findall(r'modulepreload" href="([^"]+)"', (FOLDER / "index.html").read_text("utf-8")))
    modules = {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*.js")}
    assert preloaded == modules - {"main.js"}
    for name in sorted(named):
        assert status_of(running.get(f"/{name}")) == 200, name


def test_the_page_needs_nothing_from_elsewhere() -> None:
    from quadvis.web.files import FOLDER

    for path in FOLDER.iterdir():
        if path.suffix in (".html", ".css", ".js"):
            text = path.read_text(encoding="utf-8").replace("http://www.w3.org/", "")
            assert "https://" not in text and "http://" not in text and "eval(" not in text, path.name


@pytest.mark.parametrize(
    "path",
    [
        "/../viewer.py",
        "/..%2fviewer.py",
        "/uplot/../../files.py",
        "//etc/passwd",
        "/page",
        "/main.js/",
        "/%00",
    ],
)
def test_nothing_but_the_files_of_the_page_is_served(running: Running, path: str) -> None:
    assert status_of(running.get(path)) == 404


# foreign hosts and pages


@pytest.mark.faults
@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "localhost.", ""]
)
def test_a_request_for_another_host_is_refused_and_announced(running: Running, host: str) -> None:
    answer = running.get("/", Host=host.format(port=running.port))
    assert status_of(answer) == 403 and b"<script" not in answer
    assert running.gateway.access.refusals["a request for another host"] == 1
    assert len(running.said) == 1 and "another host" in running.said[0]


def test_a_request_without_a_host_or_with_two_is_refused(running: Running) -> None:
    own = f"Host: {running.host}\r\n"
    for hosts in ("", own + own, own + "Host: evil.example\r\n"):
        assert status_of(running.plain(f"GET / HTTP/1.1\r\n{hosts}\r\n".encode())) == 403


def test_localhost_is_the_same_computer(running: Running) -> None:
    assert status_of(running.get("/", Host=f"localhost:{running.port}")) == 200


def test_parts_of_the_page_are_not_for_other_pages(running: Running) -> None:
    assert status_of(running.get("/main.js", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors")) == 403
    assert status_of(running.get("/main.js", Origin="http://evil.example")) == 403
    assert status_of(running.get("/main.js", Sec_Fetch_Site="same-origin", Sec_Fetch_Mode="cors")) == 200
    assert status_of(running.get("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")) == 200


@pytest.mark.faults
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "null", "https://127.0.0.1:{port}", None]
)
def test_a_socket_for_another_page_is_refused_and_announced(running: Running, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as caught:
        running.dial(origin and origin.format(port=running.port))
    assert caught.value.response.status_code == 403
    assert "another page" in running.said[0]


def test_refusals_do_not_flood_the_terminal(running: Running) -> None:
    for _ in range(30):
        running.get("/", Host="evil.example")
    assert running.gateway.access.refusals["a request for another host"] == 30
    assert len(running.said) == 1


# the token


@pytest.mark.faults
@pytest.mark.parametrize(
    "first",
    [
        '{"token": "x"}',
        '{"token": null}',
        '{"token": 1}',
        "{}",
        "[]",
        "{",
        '{"id": 1, "verb": "stop", "args": {}}',
    ],
)
def test_a_page_without_the_token_learns_nothing(running: Running, target: StandIn, first: str) -> None:
    with running.dial() as line:
        line.send(first)
        with pytest.raises(ConnectionClosed) as caught:
            line.recv(20)
    assert caught.value.rcvd is not None and caught.value.rcvd.code == 1008
    assert "stop" not in target.asked


def test_a_page_that_says_nothing_is_sent_away(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gateways, "TOKEN", 0.1)
    with running.dial() as line, pytest.raises(ConnectionClosed):
        line.recv(20)


def test_the_token_is_new_for_each_gateway_and_in_no_request_line(running: Running) -> None:
    other = gateways.Access(1)
    assert other.token != running.gateway.access.token and len(other.token) >= 32
    assert running.gateway.address.endswith(f"/#{running.gateway.access.token}")


# wrong and excessive input


@pytest.mark.parametrize(
    "garbage",
    [
        b"\x16\x03\x01\x02\x00\x01\x00", b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 1000 + b"\r\n",
        b"GET " + b"a" * 100_000, b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello",
        b"GET / HTTP/9.9\r\n\r\n", b"\r\n\r\n",
    ],
)  # fmt: skip
def test_garbage_ends_its_own_connection_only(
    target: StandIn, monkeypatch: pytest.MonkeyPatch, garbage: bytes
) -> None:
    monkeypatch.setattr(listener, "OPENING", 0.5)
    running = Running(target)
    answer = running.plain(garbage)
    assert not answer or 400 <= status_of(answer) < 600
    assert waited_for(lambda: running.get("/").startswith(b"HTTP/1.1 200"))
    running.close()


def test_a_message_that_is_too_long_ends_the_page(running: Running) -> None:
    with running.page() as page, pytest.raises(ConnectionClosed) as caught:
        page.line.send(json.dumps({"id": 1, "verb": "status", "args": {"x": "y" * messages.MOST_TEXT}}))
        page.next(lambda _: False)
    assert caught.value.rcvd is not None and caught.value.rcvd.code == 1009


@pytest.mark.parametrize(
    "message",
    [
        "[]",
        "{",
        '{"id": 1}',
        '{"id": true, "verb": "x", "args": {}}',
        '{"id": 1, "verb": "x", "args": 3}',
        "[" * 50_000,
    ],
)
def test_what_is_no_request_ends_the_page(running: Running, message: str) -> None:
    with running.page() as page, pytest.raises(ConnectionClosed) as caught:
        page.line.send(message)
        page.next(lambda _: False)
    assert caught.value.rcvd is not None and caught.value.rcvd.code == 1007


def test_a_flood_of_requests_is_refused_and_other_pages_do_not_notice(running: Running) -> None:
    with running.page() as page, running.page() as other:
        numbers = [page.ask("status") for _ in range(400)]
        assert other.request("status")["Application"] == "small"
        replies = [page.next(lambda message: "reply" in message) for _ in numbers]
        refused = [reply["error"] for reply in replies if not reply["ok"]]
        assert refused and set(refused) == {"this page asks for too much at once"}
        assert any(reply["ok"] for reply in replies)


def test_idle_connections_do_not_keep_a_page_out(running: Running) -> None:
    idle = [
        socket.create_connection(("127.0.0.1", running.port), 20) for _ in range(listener.CONNECTIONS + 10)
    ]
    assert waited_for(lambda: running.gateway.access.refusals["more connections than are possible"] >= 10)
    for line in idle:
        line.close()
    assert waited_for(lambda: running.get("/").startswith(b"HTTP/1.1 200"))


def test_there_is_a_limit_for_pages(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gateways, "VIEWERS", 1)
    with running.page():
        with pytest.raises(InvalidStatus) as caught:
            running.dial()
        assert caught.value.response.status_code == 503
    assert waited_for(lambda: not running.gateway.viewers)
    with running.page() as page:
        assert page.hello["target"] == "bench"


def test_a_port_that_is_taken_is_a_sentence(running: Running, target: StandIn) -> None:
    import asyncio

    async def second() -> None:
        async with gateways.Gateway(target).serving(running.port):
            pass

    with pytest.raises(QuadvisError, match=f"port {running.port} cannot be opened .*--port"):
        asyncio.run(second())


# what a page may


@pytest.mark.parametrize("verb", ["put", "unload", "_load", "__class__", "do_stop", "request", ""])
def test_a_verb_that_is_not_forwarded_never_reaches_the_target(
    running: Running, target: StandIn, verb: str
) -> None:
    with running.page() as page:
        assert "the page cannot ask for" in page.refused(verb)
    assert verb not in target.asked


def test_a_refusal_of_the_target_comes_as_its_sentence(running: Running) -> None:
    with running.page() as page:
        assert page.refused("stop") == "small does not run"
        assert "there is no application 'other'" in page.refused("load", application="other")
        page.line.send(json.dumps({"id": 99, "verb": "status", "args": {"verb": "stop", "self": 1}}))
        assert "unexpected keyword argument" in page.reply(99)["error"]


def test_level_4_sees_the_status_and_nothing_else(running: Running, target: StandIn) -> None:
    target.level = 4
    with running.page() as page:
        assert page.hello["may"] == ["status"]
        for verb in (
            "stop",
            "setparam",
            "getsignal",
            "watch",
            "drawing",
            "picture",
            "describe",
            "listen",
            "logs",
        ):
            assert "level" in page.refused(verb)
        assert page.topic("state")["data"]["Application"] == "small"
    assert not {"stop", "setparam", "getsignal", "drawing", "picture", "logs"} & set(target.asked)


def test_the_levels_are_cumulative() -> None:
    from quadvis.web.forwarding import permitted

    sets = [set(permitted(level)) for level in range(5)]
    assert all(larger > smaller for larger, smaller in pairwise(sets))
    assert "stop" in sets[1] and "stop" not in sets[2] and "setparam" not in sets[1]


# values and samples


def test_values_come_again_and_again_and_belong_to_one_tick(running: Running, target: StandIn) -> None:
    target.do_start()
    with running.page() as page:
        page.request("watch", names=["gain.y", "wave.y"])
        while (first := page.values())["wave.y"] is None:
            pass
        second = page.values()
        assert first["wave.y"] != second["wave.y"]
        assert second["gain.y"] == pytest.approx(2 * np.array(second["wave.y"]))
    assert json.loads(messages.text({"a": [math.nan, math.inf, np.float64(1)]})) == {
        "a": ["NaN", "Infinity", 1.0]
    }


def test_what_is_watched_while_the_target_answers_for_something_else_comes_too(
    running: Running, target: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    target.do_start()
    asked, go_on = threading.Event(), threading.Event()
    answer = target.do_getsignal

    def slow(names: list[str]) -> dict[str, Any]:
        if names == ["wave.y"] and not asked.is_set():
            asked.set()
            assert go_on.wait(20)
        return answer(names)

    monkeypatch.setattr(target, "do_getsignal", slow)
    with running.page() as page:
        page.request("watch", names=["wave.y"])
        assert asked.wait(20)
        page.request("watch", names=["gain.y"])
        go_on.set()
        while "gain.y" not in page.values():
            pass


def test_a_scope_gives_every_sample_once(running: Running, target: StandIn) -> None:
    target.do_start()
    with running.page() as page:
        number = page.request("addscope")
        page.request("setscope", id=number, values={"Signals": ["wave.y"], "NumSamples": 5})
        page.request("listen", topics=[f"scope/{number}"])
        page.request("startscope", ids=[number])
        packages = [page.topic(f"scope/{number}") for _ in range(4)]
    rows = np.concatenate([package["samples"] for package in packages])
    assert rows.shape == (20, 2) and np.allclose(np.diff(rows[:, 0]), 0.01)
    assert np.allclose(rows[:, 1], np.sin(2 * np.pi * rows[:, 0]), atol=1e-9)
    assert waited_for(lambda: not target._takers[f"scope/{number}"])


def test_it_ends_without_an_error_though_the_target_is_gone(
    target: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def subscribe(topic: str, take: object) -> Any:
        def end() -> None:
            asked.append(topic)
            raise QuadvisError("bench does not answer")

        return end

    async def serve() -> None:
        async with gateways.Gateway(target).serving():
            pass

    monkeypatch.setattr(target, "subscribe", subscribe)
    asyncio.run(serve())
    assert len(asked) == 1  # each question may take seconds


def test_a_scope_is_removed_though_its_page_was_closed_before_the_target_had_added_it(
    running: Running, target: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    adds, asked, goes_on = target.do_addscope, threading.Event(), threading.Event()

    def add(**arguments: Any) -> Any:
        asked.set()
        assert goes_on.wait(20)
        return adds(**arguments)

    monkeypatch.setattr(target, "do_addscope", add)
    with running.page() as page:
        page.ask("addscope")
        assert asked.wait(20)
    assert waited_for(lambda: not running.gateway.viewers)
    goes_on.set()
    assert waited_for(lambda: "remscope" in target.asked and not target.scopes)


def test_a_parameter_is_set_and_holds_from_a_tick_on(running: Running, target: StandIn) -> None:
    target.do_start()
    with running.page() as page:
        number = page.ask("setparam", values={"wave.amplitude": 3})
        event = page.next(lambda message: message.get("data", {}).get("event") == "tuned")["data"]
        found = page.reply(number)["result"]
        assert found["changes"] == event["changes"] == [{"name": "wave.amplitude", "old": 1.0, "new": 3.0}]
        assert event["tick"] == found["tick"] > 0 and found["time"] == pytest.approx(0.01 * found["tick"])
        assert "wave.amplitud" in page.refused("setparam", values={"wave.amplitud": 3})


def test_who_looks_at_old_values_sets_nothing_and_may_stop(
    running: Running, target: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    target.do_start()
    monkeypatch.setattr(viewer, "FRESH", 0.1)
    with running.page() as page:
        page.answers = False
        page.next(
            lambda message: message.get("beat", 0) and not any(v.fresh for v in running.gateway.viewers)
        )
        assert "old values" in page.refused("setparam", values={"wave.amplitude": 3})
        assert page.request("stop") is None
    assert target.state == "stopped"


def test_a_page_that_does_not_read_costs_nobody_else_anything(running: Running, target: StandIn) -> None:
    many = np.zeros((2000, 5))  # 80 kB
    with running.page() as slow, running.page() as quick:
        for page in (slow, quick):
            page.request("listen", topics=["scope/7"])
        for number in range(150):  # 12 MB, each package after the quick page had the last one
            target.publish("scope/7", {"sequence": number}, many)
            assert quick.topic("scope/7")["data"]["sequence"] == number
        (waiting,) = [each for each in running.gateway.viewers if each.dropped]
        assert sum(map(len, waiting._samples)) == waiting._size <= viewer.WAITING
        # It goes on with what is new; what was dropped is a gap in the numbers.
        numbers = [slow.topic("scope/7")["data"]["sequence"]]
        while numbers[-1] != 149:
            numbers.append(slow.topic("scope/7")["data"]["sequence"])
        assert numbers == sorted(numbers) and len(numbers) == 150 - waiting.dropped < 150


def test_a_target_that_falls_silent_is_noticed_while_the_gateway_lives(
    running: Running, target: StandIn
) -> None:
    with running.page() as page:
        page.next(lambda message: "beat" in message and message["heard"] is not None and message["heard"] < 1)
        target.silent = True
        page.next(lambda message: "beat" in message and message["heard"] > 1)
        target.silent = False
        page.next(lambda message: "beat" in message and message["heard"] < 1)


@pytest.mark.slow
def test_a_recording_and_a_picture_come_as_bytes(tmp_path: Path) -> None:
    root = Path(__file__).parents[3]
    target = StandIn(load(root / "diagrams" / "hover.yaml"), tmp_path)
    running = Running(target)
    try:
        target.do_start()
        with running.page() as page:
            while not (reply := page.reply(page.ask("picture", signal="eyes/camera.frame")))["ok"]:
                time.sleep(0.05)
            assert reply["payload"].startswith(b"\xff\xd8\xff") and reply["bytes"] == "data"
            assert reply["result"]["format"] == "jpeg" and reply["result"]["sequence"] >= 1
            page.request("stop")
            (log,) = page.request("logs")
            data = b""
            while len(data) < log["size"]:
                data += page.reply(page.ask("getlog", name=log["name"], offset=len(data)))["payload"]
            assert data == (tmp_path / "hover-1.mcap").read_bytes()
    finally:
        running.close()
        target.close()
