"""The host's end of the wire by itself, with a target that is not there."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from quadvis.wire.address import WireAddress
from quadvis.wire.client import Client
from quadvis.wire.messages import Reply, StreamData, pack_stream
from quadvis.wire.refusals import RefusedError, WireError
from quadvis.wire.subscription import Subscription


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    with Client(WireAddress(path=str(tmp_path / "nobody")), "lab") as made:
        yield made


def test_what_a_callback_raises_is_shown_and_ends_its_subscription_alone(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[BaseException | None] = []
    monkeypatch.setattr(threading, "excepthook", lambda args: shown.append(args.exc_value))

    def fail(data: StreamData) -> None:
        raise KeyError(data.topic)

    failing, plain = Subscription(("state",), 10, fail), Subscription(("state",), 10, None)
    client._subscriptions += [failing, plain]
    for number in (1, 2):
        client._streamed(pack_stream("state", number, {}))
    assert [repr(each) for each in shown] == ["KeyError('state')"]
    assert [plain.take(0).number for _ in range(2)] == [1, 2]
    client.unsubscribe(failing)
    with pytest.raises(WireError, match="has ended"):
        failing.take(0)


def test_who_was_refused_after_a_loss_of_the_connection_is_not_asked_for_again(client: Client) -> None:
    refused, later = Subscription(("scope/1",), 10, None), Subscription(("state",), 10, None)
    client._subscriptions += [refused, later]
    answer: Future[Reply] = Future()
    answer.set_result(Reply(1, error=RefusedError("no")))
    client._resubscribed([refused], answer)
    assert client._subscriptions == [later]
    with pytest.raises(RefusedError):
        refused.take(0)


def test_a_subscription_can_be_ended_at_once_though_the_target_is_gone(client: Client) -> None:
    subscription = Subscription(("state",), 10, None)
    client._subscriptions.append(subscription)
    client.unsubscribe(subscription)  # NoAnswerError would come after more than 3 s
    with pytest.raises(WireError, match="has ended"):
        subscription.take(0)
