"""Flights that hold their place although something is wrong with them: their diagrams notice it."""

from pathlib import Path

import pytest

import quadvis
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
HEIGHT, TILT, TORQUE, HEADING = "position[2]", "attitude[0:2]", "torque", "attitude[2]"
# Diagram, variant, what is wrong, and the end of the name of a signal that shows it.
WRONG = [
    ("hover", "geometric", {"pose.side": "1.1 m"}, HEIGHT),
    ("hover", "geometric", {"pose.side": "0.9 m"}, HEIGHT),
    ("hover", "geometric", {"eyes.ceiling": "4.05 m"}, HEIGHT),
    ("hover", "fused_geometric", {"craft.mass": "0.6 kg"}, HEIGHT),
    ("hover", "fused_geometric", {"pose.side": "1.1 m"}, HEIGHT),
    ("hover", "fused_geometric", {"estimate.ceiling": "4.95 m"}, HEIGHT),
    ("hover", "fused_geometric", {"craft.lag": "200 ms"}, TILT),  # a limit cycle
    ("hover", "fused_geometric", {"craft.lag": "200 ms"}, TORQUE),
    ("step", None, {"craft/body.lag": "250 ms"}, TORQUE),
    ("trajectory", None, {"craft/body.torque_bias": "[0 rad/s^2, 0 rad/s^2, 0.1 rad/s^2]"}, HEADING),
    ("blackout", None, {"pose.side": "1.1 m"}, HEIGHT),
    ("blackout", None, {"craft/body.lag": "250 ms"}, TORQUE),
    ("landing", "robust", {"craft/body.mass": "0.6 kg"}, HEIGHT),
    ("landing", None, {"craft/radio.delay": "80 ms"}, TORQUE),
    ("takeover", None, {"estimate.ceiling": "4.95 m"}, HEIGHT),
    ("takeover", None, {"craft/body.lag": "250 ms"}, "velocity"),
]


# A wrong craft of each diagram first.
FIRST = list({case[0]: case for case in reversed(WRONG)}.values())[::-1]


@pytest.mark.parametrize(
    ("name", "variant", "wrong", "shown"),
    mostly_slow(FIRST + [case for case in WRONG if case not in FIRST], quick=0, slow=len(FIRST)),
)
def test_a_wrong_craft_does_not_pass(
    name: str, variant: str | None, wrong: dict[str, str], shown: str
) -> None:
    # The hover is judged from 40 s on; a part of it shows what the whole does.
    stop = "45 s" if name == "hover" else None
    result = quadvis.load(
        DIAGRAMS / f"{name}.yaml", variant=variant, settings=wrong, stop_time=stop, seed=1
    ).run()
    missed = [verdict.expectation.selection.text for verdict in result.outcome.verdicts if not verdict.met]
    assert any(text.endswith(shown) for text in missed), missed
