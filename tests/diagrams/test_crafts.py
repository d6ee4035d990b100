"""The craft is stated once: another one is one file, which reaches every block that needs it and flies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.diagram.diagram import Diagram
from quadvis_blocks import _craft
from tests.diagrams.golden import DIAGRAMS, cases
from tests.stages import mostly_slow

CRAFTS = DIAGRAMS / "crafts"
NAMES = sorted(path.stem for path in CRAFTS.glob("*.yaml"))
FLIGHTS = [
    case
    for case in cases()
    if case[0]
    in ("hover.yaml", "step.yaml", "trajectory.yaml", "blackout.yaml", "landing.yaml", "takeover.yaml")
]
NANO = {"mass": 0.03, "arm": 0.046, "inertia": (17e-6, 17e-6, 29e-6), "torque_ratio": 0.006, "lag": 0.05}
NANO |= {"thrust_max": 0.15, "drag": 0.01, "feet": 0.03, "stiffness": 30.0}
NANO["force_limit"] = 0.12


def loaded(name: str, variant: str | None, craft: Path, **more: object) -> Diagram:
    return quadvis.load(DIAGRAMS / name, variant=variant, settings=[f"vehicle={craft}"], **more)


@pytest.mark.parametrize(("name", "variant"), FLIGHTS)
def test_every_block_of_a_flight_has_the_craft_that_its_diagram_names(name: str, variant: str | None) -> None:
    found = set()
    for node in loaded(name, variant, CRAFTS / "nano.yaml").graph.nodes:
        for parameter in NANO.keys() & node.block.interface.params.keys():
            value = getattr(node.block, parameter)
            assert np.array_equal(value, NANO[parameter]), f"{node.path}.{parameter}"
            found.add(parameter)
        if node.kind == "signal.transport_delay":
            assert node.block.initial == pytest.approx(0.25 * 0.03 * _craft.GRAVITY)
    assert found >= {"mass", "arm", "inertia", "torque_ratio", "lag", "drag", "thrust_max"}


@pytest.mark.parametrize("craft", NAMES)
def test_what_arrives_before_the_first_command_carries_the_craft(craft: str) -> None:
    graph = loaded("hover.yaml", "geometric", CRAFTS / f"{craft}.yaml").graph
    mass = graph["craft"].block.mass
    assert graph["radio"].block.initial == pytest.approx(0.25 * mass * _craft.GRAVITY, rel=1e-12)


def test_the_papers_craft_is_the_default_of_the_blocks() -> None:
    block = loaded("hover.yaml", "geometric", CRAFTS / "draganfly.yaml").graph["craft"].block
    assert (block.mass, block.arm, tuple(block.inertia)) == (_craft.MASS, _craft.ARM, _craft.INERTIA)
    assert (block.lag, block.torque_ratio) == (_craft.MOTOR_LAG, _craft.TORQUE_RATIO)
    assert (block.thrust_max, block.drag) == (_craft.THRUST_MAX, _craft.DRAG)


# First, and as machine code, so that the hovers below find nearly all of it compiled and take it.
@pytest.mark.parametrize(
    ("craft", "name", "variant"),
    mostly_slow(
        [(craft, "landing.yaml", "robust") for craft in NAMES]
        + [(craft, name, "robust") for name in ("blackout.yaml", "takeover.yaml") for craft in NAMES],
        quick=0,
        slow=len(NAMES),
    ),
)
def test_every_craft_flies_under_the_failsafe(craft: str, name: str, variant: str) -> None:
    result = loaded(name, variant, CRAFTS / f"{craft}.yaml").run(engine="native")
    assert result.passed, [str(verdict) for verdict in result.outcome.verdicts if not verdict.met]


@pytest.mark.parametrize(
    ("craft", "variant"),
    mostly_slow(
        [
            (craft, variant)
            for variant in ("geometric", "fused_geometric", "robust_geometric")
            for craft in NAMES
        ],
        quick=0,
        slow=len(NAMES) + 1,
    ),
)
def test_every_craft_hovers(craft: str, variant: str) -> None:
    result = loaded("hover.yaml", variant, CRAFTS / f"{craft}.yaml").run()
    assert result.passed, [str(verdict) for verdict in result.outcome.verdicts if not verdict.met]


@pytest.mark.slow  # test_mounts.py has a mount in the first stage
@pytest.mark.parametrize("variant", ["fused_geometric", "robust_geometric"])
def test_a_craft_with_its_camera_off_and_askew_says_so_once_and_hovers(variant: str) -> None:
    where = ["vehicle.mount_offset=[8 cm, -5 cm, 4 cm]", "vehicle.mount_angles=[3 deg, -2 deg, 15 deg]"]
    result = quadvis.load(DIAGRAMS / "hover.yaml", variant=variant, settings=where).run(engine="native")
    assert result.passed, [str(verdict) for verdict in result.outcome.verdicts if not verdict.met]
    nobody_knows = [
        *where,
        "estimate.mount_offset=[0 m, 0 m, 0 m]",
        "estimate.mount_angles=[0 deg, 0 deg, 0 deg]",
    ]
    wrong = quadvis.load(DIAGRAMS / "hover.yaml", variant=variant, settings=nobody_knows).run(engine="native")
    assert not wrong.passed
