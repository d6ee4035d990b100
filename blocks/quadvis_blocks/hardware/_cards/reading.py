"""The work of the process that reads a card: all channels again and again, each time as one frame."""

from __future__ import annotations

import time

from quadvis.block import PortError
from quadvis.machine.capture import GOOD, OPENING, Post
from quadvis_blocks.hardware._cards.frames import MICRO, ChannelKind, encode
from quadvis_blocks.hardware._cards.ports import Reading, open_card

OPEN, CALL = 5.0, 2.0  # s that the driver has to open a card, and to read it


def work(post: Post, reading: Reading) -> None:
    """Read a card until a call fails; then return, to be called again."""
    request, interval = reading.request, reading.interval
    scale = MICRO if request.kind is ChannelKind.ANALOG else 1
    numbers = [channel.number for channel in request.channels]
    post.calling(OPEN)
    try:
        card = open_card(request, sends=False)
    except PortError as error:
        post.say(OPENING, str(error), hopeless=True)
        return
    try:
        due, good = time.monotonic_ns(), False
        while True:
            post.calling(CALL)
            begin = time.monotonic_ns()
            values = [round(value * scale) for value in card.read()]
            instant = (begin + time.monotonic_ns()) // 2
            post.put(instant, post.take(), [encode(request.kind, zip(numbers, values, strict=True))])
            if not good:
                post.say(GOOD, f"{request.driver}:{request.device} is read")
                good = True
            due = max(due + interval, time.monotonic_ns())
            post.calling((due - begin) / 1e9 + CALL)
            time.sleep(max(0, due - time.monotonic_ns()) / 1e9)
    except PortError as error:
        post.say(OPENING, str(error))
    finally:
        card.close()
