"""Stands in for Betaflight's software in the loop: the same ports and protocols, with faults.

FAKE_PORTS: those of state and configuration; FAKE_FAULTS: words, see `Fake`. It is in lockstep by itself, and
so drops the library that the block preloads.
"""

import os
import select
import socket
import struct
import sys
import time

BOOT = 0.2  # s; stands for the first second of the real one
BOX_IDS = bytes([0, 1, 27])  # ARM, ANGLE, FAILSAFE
ARM_RANGE = struct.pack("<4B", 0, 0, 32, 48)  # channel 5, from 1700 us to 2100 us
NO_RANGE = bytes(4)
RX_FAILSAFE, NOT_DISARMED, THROTTLE, ARM_SWITCH = 1 << 2, 1 << 3, 1 << 7, 1 << 28
LOST, SETTLED = 150.0, 999.0  # ms without sticks, and with an open switch


class Fake:
    """Its faults are words: ``latches`` its failsafe for ever if sticks come while it boots (the flaw of the
    real one), ``hot``: throttle never low, ``unswitched``: no channel arms, ``refuses`` the first setting,
    ``unsaved``: never saves, ``deaf``: no answer, ``dies`` or ``hangs`` after 30 states, ``locked``: does not
    arm.
    """

    def __init__(self, faults: list[str]) -> None:
        self.faults = faults
        self.latched = False
        self.channels = [1500, 1500, 885, 1500] + [1000] * 12
        self.since, self.off = LOST, 0.0  # ms without sticks, and with sticks and an open switch
        self.states = 0
        self.armed = self.failsafe = False
        self.settings: list[str] = []

    @property
    def reasons(self) -> int:
        found = ARM_SWITCH if "locked" in self.faults and self.wants else 0
        if self.latched or self.since >= LOST:
            found |= RX_FAILSAFE
        if "hot" in self.faults or self.channels[2] > 1050:
            found |= THROTTLE
        if self.wants and self.off < SETTLED:
            found |= NOT_DISARMED
        return found

    step_ms = 1.0  # of one state

    @property
    def wants(self) -> bool:
        return self.channels[4] > 1700

    def sticks(self, payload: bytes) -> None:
        self.channels = list(struct.unpack("<16H", payload))
        self.since = 0
        if not self.wants:
            self.armed = False

    def step(self) -> list[float]:
        """Return the pulses of the motors."""
        self.states += 1
        self.since += self.step_ms
        if self.since < LOST and not self.wants:
            self.off += self.step_ms
        if self.armed and self.since >= LOST:
            self.armed, self.failsafe = False, True
        if self.wants and not self.armed and not self.failsafe and self.reasons == 0:
            self.armed = True
        throttle = max(55.0, self.channels[2] - 1000.0) if self.armed else 0.0
        return [1000.0 + throttle + number for number in range(4)]

    def reply(self, command: int, payload: bytes) -> bytes:
        if command == 200:
            self.sticks(payload)
            return b""
        if command == 150:
            modes = self.armed | self.failsafe << 2
            return struct.pack("<3HIBH3BBI", 125, 0, 0x23, modes, 0, 0, 4, 0, 0, 29, self.reasons)
        return {2: b"BTFL", 119: BOX_IDS, 34: NO_RANGE if "unswitched" in self.faults else ARM_RANGE}[command]


def frame(command: int, payload: bytes) -> bytes:
    body = bytes([len(payload), command]) + payload
    check = 0
    for byte in body:
        check ^= byte
    return b"$M>" + body + bytes([check])


def main() -> int:
    state_port, port = map(int, os.environ["FAKE_PORTS"].split(","))
    fake = Fake(os.environ.get("FAKE_FAULTS", "").split(","))
    fake.step_ms = 1e-6 * float(os.environ["QUADVIS_STEP"])
    reader = ("127.0.0.1", int(os.environ["QUADVIS_PORT"]))
    states = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    states.bind(("", state_port))
    server = socket.socket()
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    server.bind(("127.0.0.1", port))
    server.listen()
    time.sleep(BOOT)
    peer, received, cli = None, bytearray(), False
    begun = True
    while True:
        ready = select.select([states, server, *([peer] if peer else [])], [], [])[0]
        if server in ready:
            peer, received, cli = server.accept()[0], bytearray(), False
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # as the real one
        if peer in ready:
            found = peer.recv(1 << 16)
            if not found:
                peer = None
                continue
            received += found
            if begun and b"$M<\x20\xc8" in received:  # sticks that waited while it booted
                fake.latched = "latches" in fake.faults
            begun = False
            if "deaf" in fake.faults:
                continue
            if received[:1] == b"#" and not cli:
                cli = True
                del received[:1]
                peer.sendall(b"\r\nEntering CLI Mode\r\n\r\n# ")
            while cli and b"\n" in received:
                line, _, rest = bytes(received).partition(b"\n")
                received[:] = rest
                text = line.decode().strip()
                if text == "save":
                    if "unsaved" in fake.faults:
                        continue
                    open("eeprom.bin", "w").close()
                    return 0
                fake.settings.append(text)
                refused = "refuses" in fake.faults and len(fake.settings) == 1
                said = "###ERROR IN set: INVALID NAME###\r\n" if refused else f"{text} set\r\n"
                peer.sendall(f"{text}\r\n{said}\r\n# ".encode())
            while not cli and len(received) >= 6 and len(received) >= 6 + received[3]:
                command, payload = received[4], bytes(received[5 : 5 + received[3]])
                del received[: 6 + received[3]]
                peer.sendall(frame(command, fake.reply(command, payload)))
        if states in ready:
            packet, _ = states.recvfrom(1 << 12)
            assert len(packet) == int(os.environ["QUADVIS_STATE"])
            pulses = fake.step()
            if "dies" in fake.faults and fake.states == 30:
                print("a fault of its own")
                return 3
            if "hangs" in fake.faults and fake.states > 30:
                continue
            states.sendto(struct.pack("<H2x16f", 4, *pulses, *[0.0] * 12), reader)
            states.sendto(b"\0", reader)


if __name__ == "__main__":
    if "LD_PRELOAD" in os.environ:
        del os.environ["LD_PRELOAD"]
        os.execv(sys.executable, [sys.executable, "-I", "-S", __file__])
    raise SystemExit(main())
