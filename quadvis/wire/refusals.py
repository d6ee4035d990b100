"""What a target answers if it does not do what was asked: a sentence and its kind."""

from __future__ import annotations

from typing import ClassVar

from quadvis.errors import QuadvisError


class WireError(QuadvisError):
    """A request without a result; ``kind`` is a word for programs, the message a sentence for people."""

    kind: ClassVar[str] = "failed"


class RefusedError(WireError):
    """The level of the key, or the lack of a key, forbids it."""

    kind = "refused"


class UnknownError(WireError):
    """There is no such verb, signal, parameter, scope, file or set."""

    kind = "unknown"


class BadError(WireError):
    """An argument, or the message itself, is wrong."""

    kind = "bad"


class BusyError(WireError):
    """It cannot be done now: another operator, too many requests, not yet finished."""

    kind = "busy"


class GoneError(WireError):
    """What was asked for is no more: the application has ended, the lease is lost."""

    kind = "gone"


class NoAnswerError(WireError):
    """Nothing listens, or whoever listens is silent."""

    kind = "silent"
    exit_code = 3


class WrongTargetError(WireError):
    """The target has another key than the one that was pinned."""

    kind = "other key"
    exit_code = 4


class NotAllowedError(WireError):
    """The target does not know our key, or not from this network."""

    kind = "not allowed"
    exit_code = 5


KINDS = {each.kind: each for each in (RefusedError, UnknownError, BadError, BusyError, GoneError, WireError)}


def wire_error(kind: str, words: str) -> WireError:
    """Return the error of a reply, to be raised."""
    return KINDS.get(kind, WireError)(words)
