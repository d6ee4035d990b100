"""Frames on a CAN bus that the tests share."""

from __future__ import annotations

from pathlib import Path

# An engine's frame in the order of Intel and an actuator's in that of Motorola.
FRAMES = r"""
quadvis: 1
name: bench_bus
messages:
  engine:
    id: 0x123
    order: little
    fields:
      - {name: speed, type: u16, scale: 0.25, unit: rpm}
      - type: u32
        bits:
          - {name: torque, width: 12, signed: true, scale: 0.1, unit: N*m}
          - {name: gear, width: 4}
          - {width: 15}
          - {name: running, width: 1}
      - {type: u8, counter: 16}
    checksum: {kind: crc8_sae_j1850, over: body}
  actuator:
    id: 0x18FF50E5
    extended: true
    order: big
    fields:
      - {name: position, type: i16, scale: 0.1, unit: deg, range: [-90, 90]}
      - {name: current, type: u16, scale: 0.01, unit: A, range: [0, 20]}
    checksum: none
"""


def written(folder: Path) -> str:
    """Write the protocol into a folder, and return its path."""
    path = folder / "bench_bus.yaml"
    path.write_text(FRAMES)
    return str(path)
