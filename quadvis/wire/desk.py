"""From a message to its answer, without any socket: who may do what, and with which arguments.

A request passes the budget of its key, its envelope, its verb, the level, the arguments and the lease, in
this order; only then the target hears of it.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.wire.audit import Audit
from quadvis.wire.budget import Budget, Tally
from quadvis.wire.lease import Lease
from quadvis.wire.limits import BURST, ITEMS, ITEMS_A_REQUEST, PENDING, RATE, RENEWAL
from quadvis.wire.messages import Reply, Request, UnreadableError, pack_reply, read_request
from quadvis.wire.refusals import BadError, BusyError, GoneError, RefusedError, WireError
from quadvis.wire.verbs import CONTROL, Verb, check_level, checked, find_verb
from quadvis.wire.who import Who

_MOST_WARNED = 1000
Send = Callable[[bytes], object]
Handle = Callable[[str, Mapping[str, Any], Who], Any]


@dataclass(frozen=True)
class Done:
    """What a target answers if more than the result is known: the tick, and the values for the audit file."""

    result: Any = None
    tick: int | None = None
    old: Any = None
    new: Any = None


@dataclass(frozen=True)
class _Open:
    """A request that is answered later."""

    until: float
    who: Who
    verb: Verb
    request: Request
    args: Mapping[str, Any]
    send: Send


class Desk:
    """Answers the requests of all hosts.

    ``handle(verb, arguments, who)`` is the target: it returns plain data, `Done`, or a Future of one of them,
    and raises QuadvisError. ``later(call)`` has a call made by the thread of the server. The status of the
    target gets the name of the operator and ``facts()``.
    """

    def __init__(
        self,
        target: str,
        handle: Handle,
        *,
        lease: Lease,
        counts: Tally,
        audit: Audit | None = None,
        later: Callable[[Callable[[], object]], object] = lambda call: call(),
        say: Callable[[str], object] = lambda words: None,
        facts: Callable[[], Mapping[str, Any]] = dict,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.target, self.lease, self.counts = target, lease, counts
        self._handle, self._audit, self._later, self._say, self._clock = handle, audit, later, say, clock
        self._facts = facts
        self._budget = Budget(RATE, BURST, clock)
        self._open: dict[Future[Any], _Open] = {}
        self._waiting: Counter[bytes] = Counter()
        self._warned: set[bytes] = set()
        self.own: dict[str, Callable[[Mapping[str, Any], Who], Any]] = {
            "lease": self._lease,
            "renew": self._renew,
            "release": lambda args, who: self.lease.release(who, args["token"]),
        }

    def answer(self, who: Who, data: bytes, send: Send, socket: str = CONTROL) -> None:
        """Answer a message, now or later, once or not at all."""
        self.counts.add("messages")
        if not self._budget.spend(who.payer):
            self._too_many(who, data, send)
            return
        self._warned.discard(who.payer)
        try:
            request = read_request(data)
        except UnreadableError as error:
            self.counts.add("malformed")
            self._budget.charge(who.payer, min(len(data), ITEMS) / ITEMS_A_REQUEST)
            self._say(f"a message of {who.name} cannot be read: {error}")
            if error.id is not None:
                self._reply(Reply(error.id, error=BadError(self._worded(error))), send)
            return
        if request.items > ITEMS_A_REQUEST:
            self._budget.charge(who.payer, request.items / ITEMS_A_REQUEST)
        verb = None
        try:
            verb = find_verb(request.cmd, socket)
            check_level(verb, who.level)
            args = checked(verb, request.args)
            if verb.leased:
                self.lease.check(who)
        except WireError as error:
            self.counts.add(error.kind)
            if self._audit is not None:
                self._audit.refused(who, request.cmd, error)
            self._reply(Reply(request.id, error=type(error)(self._worded(error))), send)
            return
        self._perform(who, verb, request, args, send)

    def turn_away(self, public: bytes, data: bytes, send: Send) -> None:
        """Refuse a message of a key that was let in and is no more."""
        self.counts.add(RefusedError.kind)
        if not self._budget.spend(public, max(1, len(data) / ITEMS_A_REQUEST)):
            return
        with suppress(UnreadableError):
            error = RefusedError(self._worded(RefusedError("this key is let in no more")))
            self._reply(Reply(read_request(data).id, error=error), send)

    def close(self) -> None:
        """Answer the requests that are under way: the target is closing."""
        for future, request in list(self._open.items()):
            del self._open[future]
            error = GoneError("the target is closing")
            self._finish(request.who, request.verb, request.request, request.args, error, request.send)

    def _perform(self, who: Who, verb: Verb, request: Request, args: Mapping[str, Any], send: Send) -> None:
        try:
            own = self.own.get(verb.name)
            found = own(args, who) if own else self._handle(verb.name, args, who)
            if isinstance(found, Future):
                self._wait(found, _Open(self._clock() + request.deadline, who, verb, request, args, send))
                return
        except Exception as error:
            found = error
        self._finish(who, verb, request, args, found, send)

    def _wait(self, future: Future[Any], request: _Open) -> None:
        if self._waiting[request.who.payer] >= PENDING:
            future.cancel()
            raise BusyError(f"{PENDING} requests of this key are under way already")
        self._waiting[request.who.payer] += 1
        self._open[future] = request
        future.add_done_callback(lambda future: self._later(lambda: self._settle(future)))

    def _settle(self, future: Future[Any]) -> None:
        request = self._open.pop(future, None)
        if request is None:
            return  # it was answered at its deadline
        self._no_longer_waits(request)
        error = BusyError("it was cancelled") if future.cancelled() else future.exception()
        found = future.result() if error is None else error
        self._finish(request.who, request.verb, request.request, request.args, found, request.send)

    def watch(self) -> float | None:
        """Answer the requests whose deadline has passed; return the time to the next one (s), or None."""
        now = self._clock()
        for future, request in [pair for pair in self._open.items() if pair[1].until <= now]:
            del self._open[future]
            self._no_longer_waits(request)
            self.counts.add("late")
            words = f"'{request.verb.name}' is still under way after {request.request.deadline:g} s"
            error = BusyError(words)
            self._finish(request.who, request.verb, request.request, request.args, error, request.send)
        return min((request.until - now for request in self._open.values()), default=None)

    def _no_longer_waits(self, request: _Open) -> None:
        self._waiting[request.who.payer] -= 1
        if not self._waiting[request.who.payer]:
            del self._waiting[request.who.payer]

    def _finish(
        self, who: Who, verb: Verb, request: Request, args: Mapping[str, Any], found: Any, send: Send
    ) -> None:
        """Write what came of a request to the audit file, and send the reply."""
        if isinstance(found, BaseException):
            error = self._as_wire_error(verb, found)
            self.counts.add(error.kind)
            if self._audit is not None and verb.changes:
                self._audit.failed(who, verb.name, args, error)
            self._reply(Reply(request.id, error=error), send)
            return
        done = found if isinstance(found, Done) else Done(found)
        self.counts.add("answered")
        if verb.name == "status" and isinstance(done.result, Mapping):
            operator = self.lease.operator
            more = {"operator": operator and operator.name, "wire": self._facts()}
            done = Done({**done.result, **more})
        if self._audit is not None and verb.changes:
            self._audit.accepted(who, verb.name, args, old=done.old, new=done.new, tick=done.tick)
        self._reply(Reply(request.id, done.result, done.tick), send)

    def _as_wire_error(self, verb: Verb, error: BaseException) -> WireError:
        if isinstance(error, WireError):
            return type(error)(self._worded(error))
        if isinstance(error, QuadvisError):
            return BadError(self._worded(error))
        self._say(f"'{verb.name}' failed: {type(error).__name__}: {error}")
        return WireError(
            f"{self.target} failed in '{verb.name}' ({type(error).__name__}); its own output says more"
        )

    def _worded(self, error: BaseException) -> str:
        return f"{self.target} refuses: {error}"

    def _reply(self, reply: Reply, send: Send) -> None:
        try:
            data = pack_reply(reply)
        except BadError as error:
            data = pack_reply(Reply(reply.id, error=BadError(self._worded(error))))
        send(data)

    def _too_many(self, who: Who, data: bytes, send: Send) -> None:
        """Drop a request; the first one after an accepted one is answered."""
        self.counts.add("dropped")
        if who.payer in self._warned:
            return
        if len(self._warned) > _MOST_WARNED:
            self._warned.clear()
        self._warned.add(who.payer)
        try:
            number = read_request(data).id
        except UnreadableError:
            return
        words = f"more than {RATE} requests a second; those beyond are dropped without an answer"
        self._reply(Reply(number, error=BusyError(f"{self.target} refuses: {words}")), send)

    def _renew(self, args: Mapping[str, Any], who: Who) -> dict[str, Any]:
        self.lease.renew(who, args["token"])
        return {"lost_s": self.lease.lasts}

    def _lease(self, args: Mapping[str, Any], who: Who) -> dict[str, Any]:
        token = self.lease.take(who)
        return {"token": token, "renew_s": RENEWAL, "lost_s": self.lease.lasts}
