"""The two bridges, each until its thread is interrupted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from quadvis.bridge.datagrams import ENCODINGS
from quadvis.bridge.follower import FollowedTarget, Follower
from quadvis.bridge.foxglove import FoxgloveServer
from quadvis.bridge.parameters import BridgedParameters
from quadvis.bridge.pictures import PictureWatch
from quadvis.bridge.plotjuggler import DatagramSender
from quadvis.wire.address import LOOPBACK, WireAddress
from quadvis.wire.verbs import VERBS, check_level

OPEN_TO_ALL = (
    "whoever reaches {host} sees the signals{tunes}, without a key: leave --listen out unless all who can "
    "are to be trusted"
)
OPEN_HERE = "every program and every page in a browser of this machine may now tune parameters"

Say = Callable[[str], None]


def serve_foxglove(
    target: FollowedTarget, names: Sequence[str], host: str, port: int, tunes: bool, say: Say
) -> None:
    """Serve the signals of a target to Foxglove; QuadvisError if that cannot be. ``say`` takes sentences.

    ``names`` are those of signals or patterns, none for all. Clients may tune parameters if ``tunes``.
    """
    if tunes:
        check_level(VERBS["setparam"], target.level)
    parameters = BridgedParameters(target, tunes)
    server = FoxgloveServer(target.name, host, port, parameters, say)
    try:
        follower = Follower(target, names, server, say)
        pictures = PictureWatch(target, server.take_picture)
        server.want, server.want_pictures = follower.want, pictures.want
        try:
            follower.open()
            say(f"{target.name} is at ws://{host}:{server.port}; in a browser: {server.page}")
            if host not in LOOPBACK:
                say(OPEN_TO_ALL.format(host=host, tunes=" and may tune parameters" if tunes else ""))
            elif tunes:
                say(OPEN_HERE)
            follower.run()
        finally:
            pictures.close()
            follower.close()
    finally:
        server.close()


def send_to_plotjuggler(
    target: FollowedTarget, names: Sequence[str], address: WireAddress, encoding: str, say: Say
) -> None:
    """Send the signals of a target as datagrams; QuadvisError if that cannot be. ``say`` takes sentences."""
    sender = DatagramSender(address, ENCODINGS[encoding], say)
    try:
        follower = Follower(target, names, sender, say)
        sender.want = follower.want
        try:
            follower.open()
            say(f"{target.name} goes to {address}: start 'UDP Server' there, {encoding} with its timestamp")
            follower.run()
        finally:
            follower.close()
    finally:
        sender.close()
