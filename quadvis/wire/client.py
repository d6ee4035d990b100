"""The host's end of the wire as an object: requests, the lease, subscriptions."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as Timeout
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from quadvis.wire.address import WireAddress
from quadvis.wire.courier import CONNECTED, DENIED, FULL, LOST, OTHER_KEY, Courier
from quadvis.wire.introduction import introduced
from quadvis.wire.keys import KeyPair, fingerprint
from quadvis.wire.known import KnownTarget, check_same
from quadvis.wire.limits import LEASE, RENEWAL
from quadvis.wire.messages import Reply, Request, StreamData, pack_request, read_reply, read_stream
from quadvis.wire.refusals import (
    BadError,
    BusyError,
    GoneError,
    NoAnswerError,
    NotAllowedError,
    WireError,
    WrongTargetError,
)
from quadvis.wire.subscription import Subscription
from quadvis.wire.verbs import CONTROL, STREAM, checked, find_verb

PATIENCE = 3.0  # s
_IDLE = 0.5  # s between two looks of the courier's thread at nothing


class Client:
    """A connection to one target, made anew by itself; any thread may use it. Close it at the end.

    ``name`` is how messages call the target. Without ``pair`` there is no key: that is for paths, and for the
    loopback of an insecure target.
    """

    def __init__(
        self, address: WireAddress, name: str, pair: KeyPair | None = None, public: bytes = b""
    ) -> None:
        self.address, self.name = address, name
        self.operates = False
        self._pair, self._public = pair, public
        self._numbers = itertools.count(1)
        self._waiting: dict[int, Future[Reply]] = {}
        self._subscriptions: list[Subscription] = []
        self._token = ""
        self._renewed_at = self._next_renewal = 0.0
        self._on_lost: Callable[[WireError], object] = lambda error: None
        self._lock = threading.RLock()
        self._closed = False
        self._courier = Courier(
            address, pair, public, on_reply=self._replied, on_stream=self._streamed,
            on_change=self._changed, beat=self._beat,
        )  # fmt: skip

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def connect(self, timeout: float = PATIENCE) -> dict[str, Any]:
        """Wait for the connection (s) and return what the target says of itself.

        NoAnswerError, WrongTargetError, NotAllowedError or BusyError say why there is none.
        """
        end = time.monotonic() + timeout
        if self._courier.wait(timeout * 0.75) != CONNECTED:
            raise self._trouble(max(0.1, end - time.monotonic()))
        hello: dict[str, Any] = self.request("hello", max(0.1, end - time.monotonic()))
        return hello

    def request(self, cmd: str, deadline: float = PATIENCE, **args: Any) -> Any:
        """Return the result of a verb; WireError with the target's sentence if there is none in time (s)."""
        return self.ask(cmd, deadline, **args).result

    def ask(self, cmd: str, deadline: float = PATIENCE, **args: Any) -> Reply:
        """Do the same as `request`, and return the tick as well, if there is one."""
        future = self.send(cmd, deadline, **args)
        try:
            reply = future.result(deadline + 0.5)  # the target answers at the deadline at the latest
        except Timeout:
            future.cancel()
            if self._courier.state() == CONNECTED:
                raise NoAnswerError(f"{self.name} has not answered '{cmd}' in {deadline:g} s") from None
            raise self._trouble() from None
        if reply.error is not None:
            raise reply.error
        return reply

    def send(self, cmd: str, deadline: float = PATIENCE, **args: Any) -> Future[Reply]:
        """Send a request and return at once; a wrong verb or argument raises WireError before."""
        return self._send(cmd, deadline, args)

    def _send(self, cmd: str, deadline: float, args: dict[str, Any], *, first: bool = False) -> Future[Reply]:
        verb = find_verb(cmd, STREAM if cmd in ("subscribe", "unsubscribe") else CONTROL)
        checked(verb, args)
        if self._closed:
            raise GoneError(f"the connection to {self.name} is closed")
        number = next(self._numbers)
        future: Future[Reply] = Future()
        with self._lock:
            self._waiting[number] = future
        future.add_done_callback(lambda _: self._waiting.pop(number, None))
        data = pack_request(Request(number, cmd, args, deadline))
        self._courier.post(data, lambda: not future.done(), verb.socket, first=first)
        return future

    def operate(self, on_lost: Callable[[WireError], object] = lambda error: None) -> None:
        """Become the operator and stay it until `release`; ``on_lost`` is called in the client's thread."""
        found = self.request("lease")
        with self._lock:
            self._token, self._on_lost = found["token"], on_lost
            self._renewed_at = time.monotonic()
            self._next_renewal = self._renewed_at + RENEWAL
            self.operates = True

    def release(self) -> None:
        """Be the operator no more; nothing happens if the lease is lost already."""
        with self._lock:
            token, self._token, self.operates = self._token, "", False
        if token:
            with suppress(WireError):
                self.request("release", token=token)

    @contextmanager
    def operating(self) -> Iterator[None]:
        """Be the operator inside."""
        self.operate()
        try:
            yield
        finally:
            self.release()

    def subscribe(
        self, *topics: str, size: int = 1000, callback: Callable[[StreamData], object] | None = None
    ) -> Subscription:
        """Receive the data of topics, also after the connection was lost; see `Subscription`."""
        subscription = Subscription(topics, size, callback)
        self._courier.open_stream(self.address.stream(self.request("hello")["stream"]))
        with self._lock:
            self._subscriptions.append(subscription)
        try:
            self.request("subscribe", topics=list(topics))
        except WireError:
            self._forget(subscription)
            raise
        return subscription

    def unsubscribe(self, subscription: Subscription) -> None:
        """Receive no more of a subscription; a target that is not connected knows of none."""
        with self._lock:
            self._forget(subscription)
            left = {topic for each in self._subscriptions for topic in each.topics}
        subscription.end(GoneError("the subscription has ended"))
        unused = [topic for topic in subscription.topics if topic not in left]
        if unused and self._courier.state(STREAM) == CONNECTED:
            self.request("unsubscribe", topics=unused)

    def close(self) -> None:
        """Release the lease and close the connection."""
        if self._closed:
            return
        if self._courier.state() == CONNECTED:
            self.release()
        self._closed = True
        self._courier.close()
        self._fail(GoneError(f"the connection to {self.name} is closed"))
        for subscription in self._subscriptions:
            subscription.end(GoneError(f"the connection to {self.name} is closed"))

    def _trouble(self, patience: float = 1.0) -> WireError:
        """Return why there is no connection; a target that may have another key is asked for it."""
        state = self._courier.state()
        if state == DENIED:
            mine = "" if self._pair is None else self._pair.public.hex()
            name = "NAME" if self._pair is None else self._pair.name
            return NotAllowedError(
                f"{self.name} does not let in the key '{name}' from here; there, run "
                f"'quadvis keys allow {name} {mine} --level 3', with the level that it is to have"
            )
        if state == FULL:
            return BusyError(f"{self.name} has no room for another connection; close one")
        if not self.address.path and self._public:
            try:
                _, public = introduced(self.address, patience)
                check_same(KnownTarget(self.name, str(self.address), self._public), public)
            except (NoAnswerError, WrongTargetError) as error:
                return type(error)(
                    f"{self.name} does not answer: {error}" if error.kind == "silent" else str(error)
                )
        if state == OTHER_KEY:
            words = f"the key {fingerprint(self._public)}" if self._public else "no key"
            return NoAnswerError(
                f"what answers at {self.address} does not talk as a target with {words} does"
            )
        if self._courier.reached:
            return NoAnswerError(f"{self.name} does not answer: {self.address} is connected, and silent")
        remedy = "start it with 'quadvis target'"
        return NoAnswerError(f"{self.name} does not answer: nothing listens at {self.address}; {remedy}")

    def _replied(self, data: bytes) -> None:
        try:
            reply = read_reply(data)
        except BadError:
            return
        future = self._waiting.get(reply.id)
        if future is not None and future.set_running_or_notify_cancel():
            future.set_result(reply)

    def _streamed(self, frames: Sequence[bytes]) -> None:
        try:
            data = read_stream(frames)
        except BadError:
            return
        with self._lock:
            wanted = [each for each in self._subscriptions if data.topic in each.topics]
        for each in wanted:
            try:
                each.put(data)
            except Exception as error:  # of a callback; the lease must be renewed all the same
                self._forget(each)
                each.end(WireError(f"the callback for {data.topic} failed: {type(error).__name__}: {error}"))
                _show(error)

    def _forget(self, subscription: Subscription) -> None:
        """Hand nothing more to a subscription, which may have ended by itself."""
        with self._lock:
            if subscription in self._subscriptions:
                self._subscriptions.remove(subscription)

    def _resubscribed(self, asking: Sequence[Subscription], future: Future[Reply]) -> None:
        """End the subscriptions that have been refused; later ones are none of them."""
        error = None if future.cancelled() else future.result().error
        if error is not None:
            for each in asking:
                self._forget(each)
                each.end(error)

    def _changed(self, socket: str, state: str) -> None:
        if socket == CONTROL and state == LOST:
            self._fail(
                NoAnswerError(f"the connection to {self.name} is lost; what was asked for may have been done")
            )
        if socket == CONTROL and state == CONNECTED and self._token:
            self._next_renewal = 0.0  # the lease comes along to the new connection before any request
            self._beat()
        if socket == STREAM and state == CONNECTED:
            with self._lock:
                asking = [*self._subscriptions]
            if topics := sorted({topic for each in asking for topic in each.topics}):
                self.send("subscribe", topics=topics).add_done_callback(partial(self._resubscribed, asking))

    def _fail(self, error: WireError) -> None:
        with self._lock:
            waiting = list(self._waiting.items())
        for number, future in waiting:
            if future.set_running_or_notify_cancel():
                future.set_result(Reply(number, error=error))

    def _beat(self) -> float:
        """Renew the lease when it is time; return the time to the next renewal (s)."""
        now = time.monotonic()
        with self._lock:
            if not self._token:
                return _IDLE
            if now - self._renewed_at > LEASE:
                error = GoneError(f"the lease is lost: {self.name} has not renewed it for {LEASE:g} s")
            elif now < self._next_renewal or self._courier.state() != CONNECTED:
                return RENEWAL / 4
            else:
                self._next_renewal = now + RENEWAL
                token = self._token
                self._send("renew", LEASE, {"token": token}, first=True).add_done_callback(
                    lambda d: self._renewed(now, token, d)
                )
                return RENEWAL / 4
        self._lose(error)
        return _IDLE

    def _renewed(self, sent: float, token: str, done: Future[Reply]) -> None:
        error = None if done.cancelled() else done.result().error
        with self._lock:
            if token != self._token or self._closed or done.cancelled():
                return
            if error is None:
                self._renewed_at = sent
        if isinstance(error, GoneError):
            self._lose(error)

    def _lose(self, error: WireError) -> None:
        with self._lock:
            self._token, self.operates = "", False
        self._on_lost(error)


def _show(error: Exception) -> None:
    """Show what a callback has raised, as Python does it for a thread that ends by it."""
    trace = error.__traceback__
    threading.excepthook(threading.ExceptHookArgs((type(error), error, trace, threading.current_thread())))
