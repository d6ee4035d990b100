"""Frames on a CAN bus that the tests share."""

from __future__ import annotations

from pathlib import Path

SHIPPED = Path(__file__).parents[3] / "diagrams" / "protocols" / "lab_can.yaml"
FRAMES = SHIPPED.read_text(encoding="utf-8")


def written(folder: Path) -> str:
    """Write the protocol into a folder, and return its path."""
    path = folder / "lab_can.yaml"
    path.write_text(FRAMES)
    return str(path)
