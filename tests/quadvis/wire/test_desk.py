"""Who may do what, with which arguments: the whole way of a request but for the sockets."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.wire.audit import Audit
from quadvis.wire.budget import Tally
from quadvis.wire.desk import Desk
from quadvis.wire.lease import Lease
from quadvis.wire.levels import LEVELS
from quadvis.wire.limits import BURST, PENDING, PIECE, RATE
from quadvis.wire.messages import Reply, read_reply
from quadvis.wire.verbs import STREAM, VERBS, Verb
from quadvis.wire.who import Who
from tests.quadvis.wire.rig import ALL, RIGHT, Echo, arguments, request

KEYS = {level: bytes([level]) * 32 for level in range(len(LEVELS))}


class Bench:
    """A desk with a clock that stands, and a target that notes what it hears."""

    def __init__(self, folder: Path | None = None) -> None:
        self.now = 100.0
        self.lost: list[Who] = []
        self.lease = Lease(self.lost.append, clock=lambda: self.now)
        self.counts, self.echo, self.said = Tally(), Echo(), []
        self.audit = Audit(folder / "audit.jsonl", clock=lambda: self.now) if folder else None
        self.desk = Desk(
            "lab1", self.echo, lease=self.lease, counts=self.counts, audit=self.audit,
            say=self.said.append, clock=lambda: self.now,
        )  # fmt: skip
        self.desk.own |= dict.fromkeys(("hello", "subscribe", "unsubscribe"), lambda args, who: list(args))

    def who(self, level: int, connection: bytes = b"") -> Who:
        return Who(f"host{level}", level, KEYS[level], (0, connection or bytes([level])))

    def ask(self, who: Who, data: bytes, socket: str = "control") -> Reply | None:
        """Return the answer to a message, None if there is none now."""
        answers: list[bytes] = []
        self.desk.answer(who, data, answers.append, socket)
        assert len(answers) <= 1
        return read_reply(answers[0]) if answers else None

    def do(self, level: int, verb: str, **args: Any) -> Reply:
        found = self.ask(self.who(level), request(verb, **args), VERBS[verb].socket)
        assert found is not None
        return found

    def lines(self) -> list[dict[str, Any]]:
        assert self.audit is not None
        return [json.loads(line) for line in self.audit.path.read_text().splitlines()]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path / "audit")
    yield made
    assert made.audit is not None
    made.audit.close()


# The levels of xPC Target's web interface, said once more and independently: what each level may not do.
NOT_FROM_LEVEL = {
    1: {"load", "unload", "setparam", "saveparamset", "putparamset", "loadparamset", "deleteparamset",
        "setdefaultparamset", "settime", "setlog", "have", "put", "align"},
    2: {"start", "stop", "startprofiler", "stopprofiler", "logs", "getlog", "lease", "renew", "release"},
    3: {"parameters", "getparam", "listparamsets", "getparamset", "addscope", "remscope"},
    4: {"signals", "getsignal", "setscope", "startscope", "stopscope", "trigger", "setview", "scopes",
        "getscope",
        "pictures", "picture", "drawing", "applications", "clock", "getprofilerdata", "watch"},
}  # fmt: skip
ALWAYS = {"hello", "status", "subscribe", "unsubscribe"}


def test_the_table_of_levels_has_every_verb() -> None:
    assert set(VERBS) == ALWAYS.union(*NOT_FROM_LEVEL.values())


@pytest.mark.faults
@pytest.mark.parametrize("verb", ALL, ids=lambda verb: verb.name)
@pytest.mark.parametrize("level", range(5))
def test_a_verb_is_refused_to_all_levels_that_may_not_use_it_and_to_no_other(
    verb: Verb, level: int, bench: Bench
) -> None:
    lowest = next((first for first, verbs in NOT_FROM_LEVEL.items() if verb.name in verbs), 5)
    who = bench.who(level)
    if level <= 1:
        assert bench.do(level, "lease").error is None
    heard = len(bench.echo.calls)
    found = bench.ask(who, request(verb.name, **arguments(verb)), verb.socket)
    if level >= lowest:
        assert found is not None and found.error is not None and found.error.kind == "refused"
        assert f"lab1 refuses: this key {LEVELS[level]} (level {level})" in str(found.error)
        assert len(bench.echo.calls) == heard, "the target has heard of it"
        assert bench.counts["refused"] == 1
        assert bench.lines()[-1]["verb"] == verb.name and "refused" in bench.lines()[-1]
    elif verb.name == "load":
        assert found is None  # the echo answers later
    else:
        assert found is not None and (found.error is None or found.error.kind != "refused")


@pytest.mark.parametrize("verb", [verb for verb in ALL if verb.leased], ids=lambda verb: verb.name)
def test_a_verb_that_needs_the_lease_is_refused_without_it(verb: Verb, bench: Bench) -> None:
    for wanted in ("gone", "busy"):  # nobody has it, somebody else has it
        found = bench.do(0, verb.name, **arguments(verb))
        assert found.error is not None and found.error.kind == wanted
        bench.lease.take(bench.who(1))
    assert bench.echo.calls == []


def test_a_wrong_verb_is_unknown_and_the_nearest_one_is_named(bench: Bench) -> None:
    found = bench.ask(bench.who(0), request("setparm"))
    assert found is not None and found.error is not None
    assert found.error.kind == "unknown" and "did you mean 'setparam'?" in str(found.error)


def test_a_verb_of_the_other_socket_is_unknown(bench: Bench) -> None:
    for verb, socket in (("subscribe", "control"), ("setparam", STREAM)):
        found = bench.ask(bench.who(0), request(verb, **arguments(VERBS[verb])), socket)
        assert found is not None and found.error is not None and found.error.kind == "unknown"
    assert bench.echo.calls == []


ODD = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats() | st.text(max_size=10)
    | st.binary(max_size=10),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)  # fmt: skip
NAMES = sorted({each.name for verb in ALL for each in verb.arguments} | {"more", ""})


@pytest.mark.faults
@given(st.sampled_from(ALL), st.dictionaries(st.sampled_from(NAMES), ODD, max_size=4))
def test_odd_arguments_are_answered_with_a_sentence_and_never_reach_the_target_unchecked(
    verb: Verb, args: dict[str, Any]
) -> None:
    bench = Bench()
    bench.lease.take(bench.who(0))
    data = msgpack.packb({"v": 1, "id": 3, "cmd": verb.name, "args": args})
    found = bench.ask(bench.who(0), data, verb.socket)
    if found is None:
        assert verb.name == "load"
    elif found.error is not None:
        assert str(found.error).startswith("lab1 ") and "\n" not in str(found.error)
    right = {each.name: each for each in verb.arguments}
    if bench.echo.calls:
        assert set(args) <= set(right)
        assert all(right[name].type.holds(value) for name, value in args.items())


@pytest.mark.parametrize(
    ("verb", "args"),
    [
        ("setparam", {"values": {"a": float("nan")}}), ("setparam", {"values": {"a": float("inf")}}),
        ("setparam", {"values": {"a": [1.0, float("nan")]}}), ("setparam", {"values": {"a": None}}),
        ("setparam", {"values": {"a": b"x"}}), ("setparam", {"values": {"a": {"b": 1}}}),
        ("setparam", {"values": {}}), ("setparam", {}), ("setparam", {"values": {"": 1}}),
        ("setparam", {"values": {"a\nb": 1}}), ("settime", {"StopTime": float("nan")}),
        ("settime", {"StopTime": -1}), ("settime", {"SampleTime": 0}), ("settime", {"StopTime": True}),
        ("saveparamset", {"name": "../a"}), ("saveparamset", {"name": ""}),
        ("put", RIGHT["put"] | {"offset": -1}), ("put", RIGHT["put"] | {"file": "A" * 64}),
        ("remscope", {"ids": [0]}), ("remscope", {"ids": [True]}),
        ("getsignal", {"names": "a"}), ("getsignal", {"names": [3]}), ("stop", {"now": True}),
        ("put", RIGHT["put"] | {"data": b"x" * (PIECE + 1)}),
    ],
    ids=str,
)  # fmt: skip
def test_a_wrong_argument_is_bad(verb: str, args: dict[str, Any], bench: Bench) -> None:
    bench.lease.take(bench.who(0))
    found = bench.do(0, verb, **args)
    assert found.error is not None and found.error.kind == "bad"
    assert bench.echo.calls == []


def test_an_infinite_stop_time_is_right(bench: Bench) -> None:
    bench.lease.take(bench.who(0))
    assert bench.do(0, "settime", StopTime=float("inf")).result["args"] == {
        "StopTime": float("inf"), "SampleTime": None,
    }  # fmt: skip


def test_the_status_says_who_is_the_operator(bench: Bench) -> None:
    assert bench.do(4, "status").result["operator"] is None
    assert bench.do(1, "lease").error is None
    assert bench.do(4, "status").result["operator"] == "host1"


def test_a_flood_is_dropped_and_another_key_is_served(bench: Bench) -> None:
    answers = [bench.ask(bench.who(4), request("status")) for _ in range(BURST + 500)]
    served = [reply for reply in answers if reply is not None and reply.error is None]
    told = [reply for reply in answers if reply is not None and reply.error is not None]
    assert len(served) == BURST and len(told) == 1 and told[0].error is not None
    assert told[0].error.kind == "busy" and bench.counts["dropped"] == 500
    assert bench.do(0, "status").error is None
    bench.now += 0.1
    again = [bench.ask(bench.who(4), request("status")) for _ in range(BURST)]
    assert sum(reply is not None and reply.error is None for reply in again) == pytest.approx(
        RATE * 0.1, abs=1
    )


def test_long_messages_cost_more_whether_they_can_be_read_or_not(bench: Bench) -> None:
    long = msgpack.packb({"v": 1, "id": 1, "cmd": "getsignal", "args": {"names": [1] * 20_000}})
    cut = long[:-1]
    for level, data in ((3, long), (4, cut)):
        for _ in range(50):
            bench.ask(bench.who(level), data)
    assert bench.counts["dropped"] > 40


def test_unreadable_messages_are_counted_and_answered_at_most_once(bench: Bench) -> None:
    assert bench.ask(bench.who(0), b"\xc1") is None
    found = bench.ask(bench.who(0), msgpack.packb({"v": 9, "id": 5, "cmd": "status", "args": {}}))
    assert found is not None and found.id == 5 and found.error is not None and found.error.kind == "bad"
    assert bench.counts["malformed"] == 2 and bench.echo.calls == []


def test_a_request_is_answered_later_once(bench: Bench) -> None:
    answers: list[bytes] = []
    bench.lease.take(bench.who(0))
    bench.desk.answer(bench.who(0), request("load", 9, application="hover"), answers.append)
    assert answers == []
    bench.echo.futures[0].set_result({"application": "hover"})
    assert [read_reply(data).result for data in answers] == [{"application": "hover"}]
    assert bench.lines()[-1]["verb"] == "load"


def test_a_request_that_takes_too_long_is_answered_at_its_deadline_and_not_again(bench: Bench) -> None:
    answers: list[bytes] = []
    bench.lease.take(bench.who(0))
    bench.desk.answer(bench.who(0), request("load", 9, application="hover"), answers.append)
    assert bench.desk.watch() == 10.0
    bench.now += 10
    assert bench.desk.watch() is None
    bench.echo.futures[0].set_result("too late")
    (reply,) = map(read_reply, answers)
    assert reply.error is not None and reply.error.kind == "busy" and "after 10 s" in str(reply.error)
    assert "failed" in bench.lines()[-1]


@pytest.mark.parametrize("fault", [RuntimeError("inside"), KeyboardInterrupt(), None], ids=str)
def test_a_failure_of_the_target_is_answered_without_its_inside(
    fault: BaseException | None, bench: Bench
) -> None:
    answers: list[bytes] = []
    bench.lease.take(bench.who(0))
    bench.desk.answer(bench.who(0), request("load", 9, application="hover"), answers.append)
    future: Future[Any] = bench.echo.futures[0]
    if fault is None:
        future.cancel()
    else:
        future.set_exception(fault)
    (reply,) = map(read_reply, answers)
    assert reply.error is not None and "inside" not in str(reply.error)
    found = bench.do(3, "picture", signal="a")  # raises at once
    assert (
        found.error is not None and found.error.kind == "failed" and "ZeroDivisionError" in str(found.error)
    )


def test_few_requests_of_a_key_can_be_under_way_at_once(bench: Bench) -> None:
    bench.lease.take(bench.who(0))
    answers = [bench.ask(bench.who(0), request("load", n, application="hover")) for n in range(PENDING + 3)]
    assert [reply.error.kind for reply in answers if reply is not None and reply.error] == ["busy"] * 3
    for future in bench.echo.futures[:2]:
        future.set_result(None)
    assert bench.ask(bench.who(0), request("load", 99, application="hover")) is None


def test_closing_answers_what_is_under_way(bench: Bench) -> None:
    answers: list[bytes] = []
    bench.lease.take(bench.who(0))
    bench.desk.answer(bench.who(0), request("load", 9, application="hover"), answers.append)
    bench.desk.close()
    bench.echo.futures[0].set_result(None)
    (reply,) = map(read_reply, answers)
    assert reply.error is not None and reply.error.kind == "gone"


def test_an_answer_that_is_too_long_is_a_sentence(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench.desk, "_handle", lambda *_: b"x" * (5 << 20))
    found = bench.do(3, "drawing")
    assert found.error is not None and "ask for less" in str(found.error)


def test_changes_are_audited_with_their_values_and_their_tick(bench: Bench) -> None:
    token = bench.do(0, "lease").result["token"]
    bench.do(0, "setparam", values={"a": 1.5})
    bench.do(0, "setparam", values={"a": 2.5})
    bench.do(0, "getparam", names=["a"])
    line = bench.lines()[-1]
    assert line["time"].endswith("Z")
    assert {key: line[key] for key in ("host", "verb", "args", "old", "new", "tick")} == {
        "host": "host0", "verb": "setparam", "args": {"values": {"a": 2.5}},
        "old": {"a": 1.5}, "new": {"a": 2.5}, "tick": 101,
    }  # fmt: skip
    bench.do(0, "release", token=token)
    assert token not in bench.audit.path.read_text()  # type: ignore[union-attr]
