"""Lets the block fly the fake firmware, at ports that are free."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

import pytest

from quadvis_blocks.firmware._session import FirmwarePorts
from quadvis_blocks.firmware.betaflight import Betaflight

SOURCE = Path(__file__).with_name("fake_betaflight.py")


def faked(patch: pytest.MonkeyPatch, folder: Path, faults: str = "") -> str:
    """Return the path of a fake firmware with faults, which the block finds at ports of its own."""
    ports = FirmwarePorts(free(socket.SOCK_DGRAM), free(socket.SOCK_DGRAM), free(socket.SOCK_STREAM))
    patch.setattr(Betaflight, "endpoints", ports)
    patch.setenv("FAKE_PORTS", f"{ports.state},{ports.configuration}")
    patch.setenv("FAKE_FAULTS", faults)
    program = folder / "fake_betaflight"
    program.write_text(f"#!{sys.executable}\n{SOURCE.read_text()}")
    program.chmod(0o755)
    return str(program)


def free(kind: int) -> int:
    """Return a port of this machine that nobody has."""
    with socket.socket(socket.AF_INET, kind) as trial:
        trial.bind(("", 0))
        number: int = trial.getsockname()[1]
        return number
