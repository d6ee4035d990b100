"""Follows what a target flies, and takes the samples of its blocks by host scopes, one for each task."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from quadvis.bridge.blocks import BlockSamples, bridged_blocks, chosen_names, chosen_signals
from quadvis.errors import QuadvisError
from quadvis.output.recording import RecordedBlock
from quadvis.output.stretch import NANOSECONDS
from quadvis.wire.refusals import NoAnswerError
from quadvis.wire.verbs import VERBS, check_level

LOOK = 1.0  # s from one look at the target to the next
PIECE = 0.05  # s of samples that come together
MOST = 5_000  # samples that come together, at most
WAITING = 2_000  # pieces that wait here until they are handed on
INTERRUPTED = "Interrupted"  # the status of a scope that acquires nothing


class FollowedTarget(Protocol):
    """What a bridge needs of a target; `quadvis.Target` has it."""

    @property
    def name(self) -> str:
        """The name of the target."""

    @property
    def level(self) -> int:
        """The level of the key by which it is reached."""

    def request(self, verb: str, /, **arguments: Any) -> Any:
        """Return what the target answers to a verb; QuadvisError if it refuses."""

    def signals(self) -> list[dict[str, Any]]:
        """Return what there is to know of each signal."""

    def subscribe(self, topic: str, take: Callable[[Mapping[str, Any], Any], None]) -> Callable[[], None]:
        """Have the data of a topic handed over, in another thread; return what ends that."""


class BridgeEnd(Protocol):
    """Who gets what a bridge has, in the thread of the follower."""

    def show(self, application: str, blocks: Sequence[RecordedBlock], pictures: Sequence[str]) -> None:
        """Take another application, with its blocks and the names of its pictures; "" for none."""

    def take(self, samples: BlockSamples) -> None:
        """Take samples."""

    def hear(self, event: Mapping[str, Any]) -> None:
        """Take an event of the target."""


class _Feed(NamedTuple):
    """A scope that gives the samples of some blocks."""

    number: int
    blocks: tuple[RecordedBlock, ...]
    end: Callable[[], None]

    @property
    def signals(self) -> list[str]:
        return [block.signal(port) for block in self.blocks for port in block.ports]


class Follower:
    """Hands the end of a bridge the blocks of an application, and the samples of those that are wanted.

    ``names`` are those of the signals (patterns as in `chosen_signals`); none means all. ``say`` takes
    sentences. QuadvisError if the level of the key does not allow scopes.
    """

    def __init__(
        self, target: FollowedTarget, names: Sequence[str], end: BridgeEnd, say: Callable[[str], None]
    ) -> None:
        check_level(VERBS["addscope"], target.level)
        self._target, self._names, self._end, self._say = target, names, end, say
        self._queue: queue.Queue[Any] = queue.Queue(WAITING)
        self._lost = self._stopped = False
        self._application: tuple[str, str] | None = None
        self._blocks: dict[str, RecordedBlock] = {}
        self._periods: dict[str, float] = {}
        self._wanted: frozenset[str] = frozenset()
        self._feeds: dict[str, _Feed] = {}  # by task
        self._complaint = ""
        self._end_events: Callable[[], None] = lambda: None

    def open(self) -> None:
        """Show the end what is loaded; QuadvisError if that has no such signal."""
        self._end_events = self._target.subscribe("event", lambda header, _: self._put(dict(header)))
        self._look_at_application()

    def want(self, paths: Iterable[str]) -> None:
        """Take samples of these blocks from now on; any thread may say so."""
        self._wanted = frozenset(paths)
        self._put(None)

    def run(self) -> None:
        """Follow until `stop`, or until this thread is interrupted."""
        due = 0.0
        while not self._stopped:
            try:
                item = self._queue.get(timeout=max(0.0, due - time.monotonic()))
            except queue.Empty:
                item = None
            if callable(item):
                item()
            elif item is not None:
                self._end.hear(item)
            if not callable(item) or time.monotonic() >= due:
                self._look()
                due = time.monotonic() + LOOK

    def stop(self) -> None:
        """Let `run` return; any thread may say so."""
        self._stopped = True
        self._put(None)

    def close(self) -> None:
        """Remove the scopes; a target that does not answer once is not asked again."""
        with suppress(NoAnswerError):
            self._end_events()
            while self._feeds:
                try:
                    self._drop(next(iter(self._feeds)))
                except NoAnswerError:
                    raise
                except QuadvisError:  # it is gone with its application
                    continue

    def _put(self, item: Any) -> None:
        try:
            self._queue.put_nowait(item)
        except queue.Full:
            if not self._lost:
                self._lost = True
                self._say("samples are left out: this computer is too slow for them; name fewer by --signals")

    def _look(self) -> None:
        """See to it that what is wanted comes; say once what prevents it."""
        try:
            self._look_at_application()
            self._tend()
            self._complaint = ""
        except QuadvisError as error:
            if str(error) != self._complaint:
                self._complaint = str(error)
                self._say(self._complaint)

    def _look_at_application(self) -> None:
        status = self._target.request("status")
        name = str(status["Application"])
        if (name, status.get("Hash", "")) == self._application:
            return
        facts = self._target.signals() if name else []
        pictures = self._target.request("pictures") if name else []
        chosen = chosen_signals(facts, self._names, pictures) if name else []
        self._blocks = {block.path: block for block in bridged_blocks(chosen)}
        self._periods = {str(each["task"]): float(each["period"]) for each in chosen}
        self._application = name, status.get("Hash", "")
        self._end.show(name, list(self._blocks.values()), chosen_names(pictures, self._names))

    def _tend(self) -> None:
        """Have a scope for each task of which blocks are wanted, and no other."""
        wanted: dict[str, list[RecordedBlock]] = {}
        for path, block in self._blocks.items():
            if path in self._wanted:
                wanted.setdefault(block.rate, []).append(block)
        if not wanted and not self._feeds:
            return
        there = {each["id"]: each for each in self._target.request("scopes")}
        for task, feed in list(self._feeds.items()):
            facts = there.get(feed.number)
            if facts is None or list(facts["Signals"]) != feed.signals:  # gone with its application
                feed.end()
                del self._feeds[task]
            elif list(feed.blocks) != wanted.get(task):
                self._drop(task)
            elif facts["Status"] == INTERRUPTED:
                self._target.request("startscope", ids=[feed.number])
        for task, blocks in wanted.items():
            if task not in self._feeds:
                self._add(task, tuple(blocks))

    def _add(self, task: str, blocks: tuple[RecordedBlock, ...]) -> None:
        number = int(self._target.request("addscope", id=None, type="host"))
        feed = _Feed(number, blocks, lambda: None)
        together = max(1, min(MOST, round(PIECE / self._periods[task]))) if self._periods[task] else 1
        try:
            values = {"Signals": feed.signals, "NumSamples": together}
            self._target.request("setscope", id=number, values=values)
            end = self._target.subscribe(
                f"scope/{number}", lambda header, array: self._put(partial(self._take, task, header, array))
            )
            self._feeds[task] = feed._replace(end=end)
            self._target.request("startscope", ids=[number])
        except QuadvisError:
            self._feeds.pop(task, feed).end()
            with suppress(QuadvisError):
                self._target.request("remscope", ids=[number])
            raise

    def _drop(self, task: str) -> None:
        feed = self._feeds.pop(task)
        feed.end()
        self._target.request("remscope", ids=[feed.number])

    def _take(self, task: str, header: Mapping[str, Any], array: Any) -> None:
        feed = self._feeds.get(task)
        if feed is None or feed.number != header["scope"] or header.get("began") is None:
            return
        rows = np.asarray(array, np.float64)
        if rows.shape[1] != 1 + sum(port.size for block in feed.blocks for port in block.ports):
            return  # of the scope that had this number before
        stamps = np.rint(rows[:, 0] * NANOSECONDS).astype(np.int64) + int(header["began"])
        self._end.take(BlockSamples(feed.blocks, stamps, rows[:, 1:]))
