"""CRSF frames that others have published, and those of another program."""

from __future__ import annotations

from typing import Any

from crsf_parser import CRSFParser, PacketValidationStatus
from crsf_parser.handling import crsf_build_frame
from crsf_parser.payloads import PacketsTypes

# The centre of all channels.
CENTRE = bytes.fromhex("c81816e0031ff8c0073ef0810f7ce0031ff8c0073ef0810f7cad")


def by_parser(frame: bytes) -> dict[Any, Any]:
    """Return what crsf-parser finds in bytes, by type; the channels as a list."""
    found: dict[Any, Any] = {}

    def take(content: Any, status: Any) -> None:
        assert status == PacketValidationStatus.VALID
        payload = content.payload
        channels = content.header.type == PacketsTypes.RC_CHANNELS_PACKED
        # crsf-parser names them from the last one on.
        found[content.header.type] = payload.channels[::-1] if channels else payload

    CRSFParser(take).parse_stream(bytearray(frame))
    return found


def statistics(one: int, other: int, quality: int, ratio: int) -> bytes:
    """Return the link statistics that crsf-parser builds."""
    return bytes(
        crsf_build_frame(
            PacketsTypes.LINK_STATISTICS,
            {
                "uplink_rssi_ant_1": one, "uplink_rssi_ant_2": other, "uplink_link_quality": quality,
                "uplink_snr": ratio, "diversity_active_antenna": 0, "rf_mode": 2, "uplink_tx_power": 1,
                "downlink_rssi": 80, "downlink_link_quality": 99, "downlink_snr": 7,
            },
        )
    )  # fmt: skip
