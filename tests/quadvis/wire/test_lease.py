from __future__ import annotations

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from quadvis.wire.lease import Lease
from quadvis.wire.refusals import BusyError, GoneError
from quadvis.wire.who import Who

ANNA, BOB = (Who(name, 0, name.encode() * 8, (0, name.encode())) for name in ("anna", "bob"))


class Clock:
    now = 10.0

    def __call__(self) -> float:
        return self.now


def made() -> tuple[Lease, Clock, list[Who]]:
    clock, lost = Clock(), []
    return Lease(lost.append, 1.0, clock), clock, lost


def test_there_is_one_operator_until_the_lease_is_released() -> None:
    lease, _, lost = made()
    token = lease.take(ANNA)
    with pytest.raises(BusyError, match="anna is the operator"):
        lease.take(BOB)
    with pytest.raises(BusyError):
        lease.check(BOB)
    lease.check(ANNA)
    lease.release(ANNA, token)
    lease.take(BOB)
    assert lease.operator is BOB and lost == []


def test_a_silent_operator_loses_the_lease_once() -> None:
    lease, clock, lost = made()
    token = lease.take(ANNA)
    for _ in range(10):
        clock.now += 0.9
        lease.renew(ANNA, token)
    clock.now += 1.01
    assert lease.operator is None
    with pytest.raises(GoneError):
        lease.renew(ANNA, token)
    assert lost == [ANNA] and lease.lost == 1
    assert lease.watch() is None and lost == [ANNA]
    with pytest.raises(GoneError):
        lease.check(ANNA)
    lease.take(BOB)


def test_a_request_that_comes_after_a_silence_is_refused_even_if_nobody_looked_in_between() -> None:
    lease, clock, lost = made()
    lease.take(ANNA)
    clock.now += 5
    with pytest.raises(GoneError):
        lease.check(ANNA)
    assert lost == [ANNA]


def test_a_token_moves_the_lease_to_a_new_connection_of_the_same_key_alone() -> None:
    lease, _, _ = made()
    token = lease.take(ANNA)
    again = Who("anna", 0, ANNA.public, (0, b"new"))
    with pytest.raises(BusyError):
        lease.check(again)
    with pytest.raises(GoneError):
        lease.renew(again, "0" * 32)
    with pytest.raises(GoneError):
        lease.renew(BOB, token)
    lease.renew(again, token)
    lease.check(again)
    with pytest.raises(BusyError):
        lease.check(ANNA)


class Hosts(RuleBasedStateMachine):
    """Two hosts take, renew, release and are silent at random; a plain model says who may be the operator."""

    def __init__(self) -> None:
        super().__init__()
        self.lease, self.clock, self.lost = made()
        self.tokens: dict[str, str] = {}
        self.holder: Who | None = None
        self.until = 0.0
        self.losses = 0

    def expire(self) -> None:
        if self.holder is not None and self.clock.now >= self.until:
            self.holder = None
            self.losses += 1

    @rule(step=st.sampled_from([0.0, 0.125, 0.5, 1.0, 3.0]))
    def wait(self, step: float) -> None:
        self.clock.now += step

    @rule(who=st.sampled_from([ANNA, BOB]))
    def take(self, who: Who) -> None:
        self.expire()
        if self.holder in (None, who):
            self.tokens[who.name] = self.lease.take(who)
            self.holder, self.until = who, self.clock.now + 1.0
        else:
            with pytest.raises(BusyError):
                self.lease.take(who)

    @rule(who=st.sampled_from([ANNA, BOB]), what=st.sampled_from(["renew", "release"]))
    def use(self, who: Who, what: str) -> None:
        self.expire()
        token = self.tokens.get(who.name, "0" * 32)
        if self.holder is who:
            getattr(self.lease, what)(who, token)
            self.holder, self.until = (who, self.clock.now + 1.0) if what == "renew" else (None, 0.0)
        else:
            with pytest.raises(GoneError):
                getattr(self.lease, what)(who, token)

    @invariant()
    def operator_is_that_of_the_model(self) -> None:
        self.expire()
        assert self.lease.operator is self.holder
        self.lease.watch()
        assert len(self.lost) == self.losses


TestHosts = Hosts.TestCase
TestHosts.settings = settings(stateful_step_count=20)
