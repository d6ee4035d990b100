"""The gateway: one port of this computer that serves the page, and between the page and the target.

Everything here runs in one event loop. The target's own threads hand over what they have by
`loop.call_soon_threadsafe`; requests wait for the target in a few threads.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.version import __version__
from quadvis.web import messages
from quadvis.web.access import LOOPBACK, Access
from quadvis.web.described import described
from quadvis.web.forwarding import COMMANDS, PATIENCE, SCOPE, check_verb, permitted
from quadvis.web.line import DirectLine
from quadvis.web.listener import Listener
from quadvis.web.rate import Allowance
from quadvis.web.viewed import ViewedTarget
from quadvis.web.viewer import FRESH, Viewer
from quadvis.web.watch import SignalWatch

VIEWERS = 8  # open pages
TOKEN = 2.0  # s until a page has shown its token
BEAT = 0.25  # s between beats
LOST = 300.0  # s without an answer until a page is given up
PENDING = 16  # requests of one page that wait for the target
WAITING = 1000  # messages of the target that wait for the event loop


class Gateway:
    """The pages that look at a target."""

    def __init__(self, target: ViewedTarget, announce: Callable[[str], None] = lambda _: None) -> None:
        self.viewers: set[Viewer] = set()
        self.target = target
        self.lost = 0  # messages of the target that the event loop was too slow for
        self._announce = announce
        self._watch = SignalWatch(target, self._forward)
        self._streams: dict[str, Callable[[], None]] = {}  # by topic: what ends it
        self._last: dict[str, str | bytes] = {}  # the newest status, and what is watched
        self._workers = ThreadPoolExecutor(PENDING // 2, "request")
        self._heads = messages.Heads()
        self._waiting: deque[tuple[str, str | bytes]] = deque()
        self._woken = False
        self._loop: asyncio.AbstractEventLoop
        self._listener: Listener

    @property
    def address(self) -> str:
        """The address for a browser, with the token."""
        return f"http://{LOOPBACK}:{self._listener.port}/#{self.access.token}"

    @property
    def access(self) -> Access:
        """The rules of its port."""
        return self._listener.access

    @asynccontextmanager
    async def serving(self, port: int = 0) -> AsyncIterator[Gateway]:
        """Serve on a port of the loopback interface; 0 is any free one. QuadvisError if it is taken."""
        self._loop = asyncio.get_running_loop()
        self._listener = Listener(self._page, lambda: len(self.viewers) < VIEWERS)
        server = await self._listener.open(port, self._announce)
        self._listen("state")
        self._listen("event")
        self._watch.start()
        beats = asyncio.create_task(self._beat())
        try:
            yield self
        finally:
            beats.cancel()
            self._watch.close()
            server.close()
            await server.wait_closed()
            with suppress(QuadvisError):  # whoever does not answer once is not asked again
                while self._streams:
                    self._streams.popitem()[1]()
            self._workers.shutdown(wait=False, cancel_futures=True)

    # one page

    async def _page(self, socket: Any) -> None:
        """Talk with one page."""
        try:
            first = messages.read(await asyncio.wait_for(socket.recv(), TOKEN))
        except (QuadvisError, TimeoutError):
            first = {}
        if not self.access.knows(first.get("token")):
            await socket.close(1008, "this page lacks the token: open the address that quadvis web prints")
            return
        if len(self.viewers) >= VIEWERS:
            await socket.close(1013, "too many pages are open")
            return
        viewer = Viewer(DirectLine(socket))
        viewer.tell(self._hello())
        if "watched" in self._last:
            viewer.tell(self._last["watched"])
        if "state" in self._last:
            viewer.newest("state", self._last["state"])
        self.viewers.add(viewer)
        sending = asyncio.create_task(self._deliver(viewer, socket))
        try:
            await self._receive(viewer, socket)
        finally:
            self.viewers.discard(viewer)
            sending.cancel()
            self._workers.submit(self._remove, viewer.scopes)
            self._rewatch()
            self._relisten()

    def _hello(self) -> str:
        level = self.target.level
        facts = {"target": self.target.name, "level": level, "may": permitted(level), "version": __version__}
        return messages.text({"hello": facts | {"old": FRESH}})

    @staticmethod
    async def _deliver(viewer: Viewer, socket: Any) -> None:
        with suppress(Exception):  # the page is gone: whoever receives from it sees so, too
            await viewer.deliver()
        await socket.close(1013, "this page is too slow")

    async def _receive(self, viewer: Viewer, socket: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        allowance, pending = Allowance(), set[asyncio.Task[None]]()
        with suppress(ConnectionClosed):
            async for message in socket:
                try:
                    found = messages.read(message)
                    if "beat" in found:
                        viewer.answered(found["beat"])
                        continue
                    request = messages.read_request(found)
                except QuadvisError as error:
                    self.access.refuse("a message that is no request")
                    await socket.close(1007, str(error))
                    return
                if not allowance.take() or len(pending) >= PENDING:
                    self.access.refuse("more requests than are possible")
                    viewer.tell(messages.refusal(request.id, "this page asks for too much at once"))
                    continue
                task = asyncio.create_task(self._do(viewer, request))
                pending.add(task)
                task.add_done_callback(pending.discard)
        for task in pending:
            task.cancel()

    async def _do(self, viewer: Viewer, request: messages.PageRequest) -> None:
        """Do what a page asks for."""
        try:
            check_verb(request.verb, self.target.level)
            if request.verb in COMMANDS and not viewer.fresh:
                raise QuadvisError("the page shows old values: wait until it shows new ones")
            viewer.tell(messages.reply(request.id, await self._result(viewer, request)))
        except QuadvisError as error:
            viewer.tell(messages.refusal(request.id, str(error)))
        except Exception as error:
            self._announce(f"{request.verb}: {type(error).__name__}: {error}")
            viewer.tell(messages.refusal(request.id, "the gateway failed here; its terminal says why"))

    async def _result(self, viewer: Viewer, request: messages.PageRequest) -> Any:
        if request.verb == "watch":
            viewer.watched = frozenset(messages.read_names(request.arguments, "names"))
            self._rewatch()
            return None
        if request.verb == "listen":
            topics = messages.read_names(request.arguments, "topics")
            if not all(map(SCOPE.fullmatch, topics)):
                raise QuadvisError("a page listens to scopes, such as 'scope/1'")
            viewer.listens = frozenset(topics)
            self._relisten()
            return None
        if request.verb == "describe":
            work = partial(described, str(request.arguments.get("block")))
        else:
            if request.verb in PATIENCE:
                request.arguments["deadline"] = PATIENCE[request.verb]
            elif "deadline" in request.arguments:
                raise QuadvisError("a page has no 'deadline'")
            work = partial(self.target.request, request.verb, **request.arguments)
            if request.verb == "addscope":
                work = partial(self._add, viewer, work)
        return await self._loop.run_in_executor(self._workers, work)

    def _add(self, viewer: Viewer, work: Callable[[], Any]) -> Any:
        """Add a scope for a page, in the thread of a worker: the page may be gone by then."""
        number = work()
        viewer.scopes.add(number)
        if viewer not in self.viewers:
            self._remove({number})
        return number

    def _remove(self, scopes: set[int]) -> None:
        """Remove the scopes that a page has left."""
        for number in list(scopes):
            with suppress(QuadvisError):  # they are gone with their application, or the page removed them
                self.target.request("remscope", ids=[number])

    # what comes from the target

    def _rewatch(self) -> None:
        self._watch.names(set().union(*(viewer.watched for viewer in self.viewers)))

    def _relisten(self) -> None:
        """Begin and end the streams of scopes, as the pages want it."""
        wanted = {"state", "event"}.union(*(viewer.listens for viewer in self.viewers))
        for topic in wanted - self._streams.keys():
            self._listen(topic)
        for topic in self._streams.keys() - wanted:
            self._streams.pop(topic)()

    def _listen(self, topic: str) -> None:
        self._streams[topic] = self.target.subscribe(topic, partial(self._take, topic))

    def _take(self, topic: str, header: Mapping[str, Any], array: Any) -> None:
        """Take stream data, in a thread of the target's."""
        self._watch.heard = time.monotonic()
        self._forward(topic, header, array)

    def _forward(self, topic: str, header: Mapping[str, Any], array: Any) -> None:
        """Pack what is for pages, once for all of them, in any thread."""
        if array is None:
            self._hand_over(topic, messages.text({"topic": topic, "data": header}))
        else:
            self._hand_over(topic, self._heads.packed(topic, header, array))

    def _hand_over(self, topic: str, message: str | bytes) -> None:
        """Hand a message to the event loop, in any thread; drop it if too many wait there.

        The loop is woken for the first of those that wait: it takes them all.
        """
        if len(self._waiting) >= WAITING:
            self.lost += 1
            return
        self._waiting.append((topic, message))
        if not self._woken:
            self._woken = True
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._take_waiting)

    def _take_waiting(self) -> None:
        self._woken = False  # before the first one is taken, so that none is left behind
        while self._waiting:
            self._pass_on(*self._waiting.popleft())
        for viewer in self.viewers:
            viewer.send()

    def _pass_on(self, topic: str, message: str | bytes) -> None:
        if topic in ("state", "watched"):
            self._last[topic] = message
        for viewer in self.viewers:
            if topic in ("state", "values"):
                viewer.newest(topic, message)
            elif topic in ("event", "watched"):
                viewer.tell(message)
            elif topic in viewer.listens:
                viewer.samples(message)

    async def _beat(self) -> None:
        """Tell each page now and then that the gateway is there, and how long ago the target was heard of."""
        number = 0
        while True:
            heard = time.monotonic() - self._watch.heard if self._watch.heard else None
            number += 1
            for viewer in self.viewers:
                facts = {"beat": number, "heard": heard, "dropped": viewer.dropped + self.lost}
                viewer.beat(number, messages.text(facts))
                viewer.send()
                if viewer.gone or viewer.silent > LOST:
                    viewer.give_up()
            await asyncio.sleep(BEAT)
