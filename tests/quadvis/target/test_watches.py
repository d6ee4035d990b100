"""Sets of signals that hosts watch: their numbers, and what makes room for what."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import QuadvisError
from quadvis.target import watches as module
from quadvis.target.newest import NewestValues
from quadvis.target.watches import Watches

TEXT = """
quadvis: 1
name: small
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz}}
  force: {block: sources.constant, rate: fast, with: {value: [1, 2, 3]}}
  time: {block: sources.ramp, rate: fast, with: {slope: 1 s/s}}
  news: {block: supervision.frame_news, rate: fast, in: {stamp: time.y}}
"""


class Host:
    """A target's streams, with somebody who listens to ``topics``."""

    def __init__(self, folder: Path) -> None:
        self.newest = NewestValues(load_text(TEXT, folder))
        self.topics: set[str] = set()
        self.heard: list[tuple[str, Any, Any]] = []
        self.watches = Watches(
            self.newest,
            lambda topic, header, array: self.heard.append((topic, header, array)),
            lambda topic: topic in self.topics,
        )

    def watch(self, *names: str) -> Any:
        found = self.watches.add(names)
        self.topics.add(found["topic"])
        return found

    def row(self, block: str, *values: float) -> None:
        """Let a row of float64 and truths come."""
        words = [np.float64(value).view(np.int64) if isinstance(value, float) else value for value in values]
        (tap,) = [tap for tap in self.newest.taps if tap.block == block]
        tap.take(0, memoryview(np.array(words, np.int64).tobytes()))


@pytest.fixture
def host(tmp_path: Path) -> Host:
    return Host(tmp_path)


def test_numbers_of_all_types_and_shapes_lie_in_the_order_of_the_names(host: Host) -> None:
    found = host.watch("news.fresh", "force.y", "wave.y", "force.y[1:3]", "news.reason")
    assert found["sizes"] == [1, 3, 1, 2, 1]
    host.row("wave", 0.25)
    host.watches.tell()
    (topic, header, numbers) = host.heard.pop()
    assert topic == found["topic"] and header == {"set": found["set"], "without": [0, 1, 3, 4]}
    host.row("force", 1.0, -0.0, 1e300)
    host.row("news", 0.5, 1, -(2**40))
    host.watches.tell()
    (_, header, numbers) = host.heard.pop()
    assert header["without"] == [] and numbers.dtype == np.float64
    assert numbers.tolist() == [1.0, 1.0, 0.0, 1e300, 0.25, 0.0, 1e300, -(2.0**40)]


def test_nothing_is_sent_twice_and_nothing_that_nobody_wants(host: Host) -> None:
    found = host.watch("wave.y")
    host.row("wave", 1.0)
    host.watches.tell()
    host.watches.tell()
    host.row("force", 1.0, 2.0, 3.0)
    host.watches.tell()
    assert len(host.heard) == 1
    host.row("wave", 1.0)  # the same value is news, too
    host.watches.tell()
    assert len(host.heard) == 2
    host.topics.remove(found["topic"])
    host.row("wave", 2.0)
    host.watches.tell()
    assert len(host.heard) == 2


def test_a_large_set_comes_seldom_and_its_last_numbers_come_all_the_same(
    host: Host, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MANY", 3)
    monkeypatch.setattr(module.time, "monotonic", lambda: clock)
    clock = 100.0
    host.watch("wave.y")
    large = host.watch("force.y")
    for value in (1.0, 2.0):
        host.row("wave", value)
        host.row("force", value, value, value)
        host.watches.tell()
    assert [topic for topic, _, _ in host.heard].count(large["topic"]) == 1 and len(host.heard) == 3
    clock = 100.0 + module.REST
    host.watches.tell()
    topic, _, numbers = host.heard[-1]
    assert topic == large["topic"] and numbers.tolist() == [2.0, 2.0, 2.0]


def test_hosts_that_watch_the_same_share_a_topic_and_a_mark_tells_sets_apart(host: Host) -> None:
    first, second = host.watch("wave.y", "force.y"), host.watch("wave.y", "force.y", "wave.y")
    assert first == second
    other = host.watch("force.y", "wave.y")
    assert other["topic"] != first["topic"] and other["set"] != first["set"]


def test_sets_make_room_for_others_only_when_nobody_listens(
    host: Host, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "SETS", 2)
    one, _ = host.watch("wave.y"), host.watch("force.y")
    with pytest.raises(QuadvisError, match="hosts may watch 2 sets"):
        host.watches.add(["time.y"])
    host.topics.remove(one["topic"])
    host.watch("time.y")
    monkeypatch.setattr(module, "SIGNALS", 3)
    with pytest.raises(QuadvisError, match="of together 3 signals"):
        host.watches.add(["time.y", "wave.y"])


def test_a_signal_that_is_not_there_is_refused_with_the_one_that_is_meant(host: Host) -> None:
    with pytest.raises(QuadvisError, match=r"wave\.z.*wave\.y"):
        host.watches.add(["wave.z"])
