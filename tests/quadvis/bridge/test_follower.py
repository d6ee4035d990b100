"""What follows a target: its scopes, through other applications, other scopes and lost ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from quadvis.bridge.blocks import BlockSamples
from quadvis.bridge.follower import Follower
from quadvis.errors import QuadvisError
from quadvis.output.recording import RecordedBlock
from quadvis.wire.refusals import NoAnswerError
from tests.processes import wait_for
from tests.quadvis.bridge.scripted import BEGAN, ScriptedTarget, following


class Kept:
    """An end of a bridge that keeps all."""

    def __init__(self) -> None:
        self.shown: list[tuple[str, list[str]]] = []
        self.samples: list[BlockSamples] = []
        self.events: list[Mapping[str, Any]] = []

    def show(self, application: str, blocks: Sequence[RecordedBlock], pictures: Sequence[str]) -> None:
        self.shown.append((application, [block.path for block in blocks]))

    def take(self, samples: BlockSamples) -> None:
        self.samples.append(samples)

    def hear(self, event: Mapping[str, Any]) -> None:
        self.events.append(event)


def test_each_task_has_a_scope_which_is_removed_at_the_end() -> None:
    target, end = ScriptedTarget(), Kept()
    with following(target, end, said=[]) as follower:
        follower.want(["/craft", "/eyes/detector"])
        wait_for(lambda: target.scope_of("craft.position") and target.scope_of("eyes/detector.found"))
        assert sorted(each["NumSamples"] for each in target.scopes.values()) == [1, 5]
        target.samples("eyes/detector.found", [[0.1, 1.0]])
        wait_for(lambda: end.samples)
        assert end.samples[0].stamps.tolist() == [BEGAN + 100_000_000]
    assert target.scopes == {} and end.shown == [("scripted", ["/craft", "/law", "/eyes/detector"])]


def test_a_target_that_is_gone_is_asked_once_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    target = ScriptedTarget()

    def silent(ids: list[int]) -> None:
        raise NoAnswerError("lab does not answer")

    with following(target, Kept(), said=[]) as follower:
        follower.want(["/craft", "/eyes/detector"])
        wait_for(lambda: target.scope_of("craft.position") and target.scope_of("eyes/detector.found"))
        monkeypatch.setattr(target, "do_remscope", silent)
    assert [verb for verb, _ in target.calls].count("remscope") == 1


def test_a_scope_that_is_gone_already_keeps_no_other_one(monkeypatch: pytest.MonkeyPatch) -> None:
    target = ScriptedTarget()
    removes = target.do_remscope

    def remove(ids: list[int]) -> None:
        removes(ids)
        raise QuadvisError("there is no such scope")

    monkeypatch.setattr(target, "do_remscope", remove)
    with following(target, Kept(), said=[]) as follower:
        follower.want(["/craft", "/eyes/detector"])
        wait_for(lambda: target.scope_of("craft.position") and target.scope_of("eyes/detector.found"))
    assert target.scopes == {}


def test_a_scope_that_was_interrupted_or_removed_comes_back() -> None:
    target = ScriptedTarget()
    with following(target, Kept(), said=[]) as follower:
        follower.want(["/craft"])
        number = wait_for(lambda: target.scope_of("craft.position"))
        target.scopes[number]["Status"] = "Interrupted"  # as when a run ends
        target.takers["event"]({"event": "stopped"}, None)
        wait_for(lambda: target.scope_of("craft.position"))
        del target.scopes[number]  # as when the application is loaded again
        target.takers["event"]({"event": "loaded"}, None)
        wait_for(lambda: target.scope_of("craft.position"))
        target.scopes[number]["Signals"] = ["law.level"]  # somebody's own scope has got the number
        target.takers["event"]({"event": "loaded"}, None)
        wait_for(lambda: target.scope_of("craft.position"))
        assert len(target.scopes) == 2
    assert list(target.scopes) == [number]  # it is somebody's own, and stays


def test_what_prevents_it_is_said_once_and_it_goes_on() -> None:
    target, said = ScriptedTarget(), list[str]()

    def full(id: int | None, type: str) -> int:
        raise QuadvisError("there are 10 host scopes already; remove one first")

    target.do_addscope = full  # type: ignore[method-assign]
    with following(target, Kept(), said=said) as follower:
        follower.want(["/craft"])
        wait_for(lambda: sum(verb == "addscope" for verb, _ in target.calls) > 1)
        assert said == ["there are 10 host scopes already; remove one first"]
        del target.do_addscope
        wait_for(lambda: target.scope_of("craft.position"))


def test_samples_of_a_scope_that_was_dropped_are_dropped() -> None:
    target, end = ScriptedTarget(), Kept()
    with following(target, end, said=[]) as follower:
        follower.want(["/craft"])
        number = wait_for(lambda: target.scope_of("craft.position"))
        late = target.takers[f"scope/{number}"]
        follower.want([])
        wait_for(lambda: not target.scopes)
        late({"scope": number, "began": BEGAN}, [[0.0] * 7])
        target.takers["event"]({"event": "said"}, None)
        wait_for(lambda: end.events)
        assert end.samples == []


def test_a_key_that_may_have_no_scope_is_refused() -> None:
    with pytest.raises(QuadvisError, match=r"'addscope' needs level 2 or lower"):
        Follower(ScriptedTarget(level=3), [], Kept(), print)


def test_a_name_that_means_nothing_is_refused_at_the_start() -> None:
    with (
        pytest.raises(QuadvisError, match=r"no signal 'craft\.positon'; did you mean 'craft\.position'"),
        following(ScriptedTarget(), Kept(), "craft.positon", said=[]),
    ):
        pass
