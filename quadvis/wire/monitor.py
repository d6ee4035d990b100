"""What the monitor of a ZeroMQ socket says. pyzmq's own reader imports asyncio, which takes long."""

from __future__ import annotations

import struct
from typing import Any

import zmq


def next_event(monitor: zmq.Socket[Any]) -> tuple[int, int]:
    """Return the next event, and its value: a descriptor, or a number that belongs to the event.

    Source: zmq_socket_monitor(3).
    """
    event, value = struct.unpack("=Hi", monitor.recv_multipart()[0])
    return event, value
