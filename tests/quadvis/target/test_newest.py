"""What a target says of its signals."""

from __future__ import annotations

from pathlib import Path

from quadvis.api import load
from quadvis.target.newest import NewestValues

HOVER = Path(__file__).resolve().parents[3] / "diagrams" / "hover.yaml"


def test_a_signal_has_its_names_at_the_ports_of_parts() -> None:
    facts = {each["name"]: each for each in NewestValues(load(HOVER, variant="geometric")).facts()}
    assert facts["craft.position"]["also"] == []
    (circles,) = [each for each in facts.values() if "eyes.centres" in each["also"]]
    assert circles["shape"] == [4, 2] and circles["unit"] == "px"
