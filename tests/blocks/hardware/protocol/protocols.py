"""Protocols that the tests share, each as a file's text."""

from __future__ import annotations

from pathlib import Path

from quadvis_blocks.hardware._protocol.description import DeviceProtocol, ProtocolMessage
from quadvis_blocks.hardware._protocol.reading import read_protocol

# A depth below the transducer, and a position, as NMEA 0183 has them.
NMEA = r"""
quadvis: 1
name: nmea
messages:
  depth:
    header: $
    fields:
      - SDDPT
      - {name: depth, format: "%.1f", unit: m, range: [0, 200]}
      - {name: keel, format: "%.1f", unit: m, range: [-10, 10], optional: true}
    separator: ","
    checksum: xor
    terminator: "\r\n"
  fix:
    header: $
    fields:
      - GPGLL
      - {name: latitude, format: "%08.3f"}
      - {name: north, words: {N: 1, S: -1}}
      - {name: longitude, format: "%09.3f"}
      - {name: east, words: {E: 1, W: -1}}
      - {ignore: text}
      - {name: good, words: {A: 1, V: 0}}
    separator: ","
    checksum: xor
    terminator: "\r\n"
"""

# An inertial unit in bytes: everything that a message of bytes can have.
BYTES = r"""
quadvis: 1
name: bytes_imu
order: little
line: {baud: 460800, parity: even, stop_bits: 2, settle: 1.5 s, dtr: true}
initialise: ['\x01start', [2, 0x03]]
terminate: stop
messages:
  imu:
    header: [0xAA, 0x55]
    fields:
      - {type: u8, counts: after}
      - [0x10]
      - {type: u16, counter: 1000, order: big}
      - {name: gyro, type: i16, elements: 3, scale: 0.01, unit: deg/s, range: [-320, 320]}
      - {name: temperature, type: u8, scale: 0.5, offset: -40, unit: K}
      - {ignore: 2}
      - type: u16
        bits:
          - {name: mode, width: 3}
          - {width: 2}
          - {name: trim, width: 6, signed: true, scale: 0.1, unit: V}
          - {name: armed, width: 1}
      - {name: height, type: f32, unit: m, range: [-1, 50]}
      - {name: ticks, type: u32, order: big}
    checksum: {kind: crc16_modbus, over: all}
    terminator: [0x0D]
  status:
    header: [0xAA, 0x55]
    fields:
      - {type: u8, counts: after}
      - [0x11]
      - {name: volts, type: u16, scale: 0.001, unit: V}
    checksum: {kind: crc16_modbus, over: all}
    terminator: [0x0D]
"""


def protocol(text: str, folder: Path) -> DeviceProtocol:
    """Return the protocol of a text."""
    path = folder / "protocol.yaml"
    path.write_text(text, encoding="utf-8")
    return read_protocol(path)


def message(text: str, name: str, folder: Path) -> ProtocolMessage:
    """Return a message of the protocol of a text."""
    return protocol(text, folder).messages[name]
