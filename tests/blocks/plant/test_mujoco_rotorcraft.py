"""The craft in MuJoCo, judged by plant.rotorcraft, which has equations of its own for the same craft."""

from __future__ import annotations

import builtins
import math
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import ParameterError
from quadvis.errors import DiagramError
from quadvis.testing import Driven, drive
from quadvis_blocks import _craft
from quadvis_blocks.plant.mujoco_rotorcraft import MujocoRotorcraft
from quadvis_blocks.plant.rotorcraft import Rotorcraft

MODEL = Path(__file__).parents[3] / "diagrams" / "models" / "rotorcraft.xml"
TEXT = MODEL.read_text()
LOOSE = "<body><freejoint/><geom size='1'/></body>"
HIGH = (1.0, -2.0, 50.0)
HOVER = np.full(4, 0.25 * _craft.MASS * _craft.GRAVITY)


def fly(
    thrust: Any = HOVER, steps: int = 201, rate: str = "200 Hz", wind: Any = (0, 0, 0), **more: Any
) -> Driven:
    given = {"model": str(MODEL), "initial_position": HIGH} | more
    return drive(MujocoRotorcraft(**given), thrust=thrust, wind=wind, rate=rate, steps=steps)


def edited(folder: Path, old: str, new: str) -> str:
    assert old in TEXT
    (folder / "edited.xml").write_text(TEXT.replace(old, new))
    return str(folder / "edited.xml")


def refusal(**given: Any) -> str:
    with pytest.raises(ParameterError) as caught:
        MujocoRotorcraft(**{"model": str(MODEL)} | given)
    assert caught.value.parameter == "model"
    return str(caught.value)


def test_it_hovers_where_it_starts() -> None:
    result = fly(steps=1001)
    assert np.abs(result.position - HIGH).max() < 1e-9
    assert np.abs(result.attitude).max() < 1e-12


def test_the_model_is_the_craft_of_the_other_blocks() -> None:
    root = xml.fromstring(TEXT)
    inertial, motor = root.find("worldbody/body/inertial"), root.find("default/general")
    assert inertial is not None and motor is not None
    assert float(inertial.attrib["mass"]) == _craft.MASS
    assert tuple(map(float, inertial.attrib["diaginertia"].split())) == _craft.INERTIA
    assert float(motor.attrib["dynprm"]) == _craft.MOTOR_LAG
    assert motor.attrib["ctrlrange"] == f"0 {_craft.THRUST_MAX:g}"
    places = [np.fromstring(site.attrib["pos"], sep=" ") for site in root.iter("site")]
    assert [np.abs(place).max() for place in places] == [_craft.ARM] * 4
    ratios = [float(rotor.attrib["gear"].split()[-1]) for rotor in root.iterfind("actuator/general")]
    assert np.abs(ratios) == pytest.approx([_craft.TORQUE_RATIO] * 4)


@pytest.mark.parametrize("drag", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_it_moves_as_the_equations_of_a_rigid_body_say(seed: int, drag: float) -> None:
    """Random thrusts, limits included, in wind, from a turned and tilted start that moves.

    The drag is held over a time step, so with drag the two agree less well.
    """
    random = np.random.default_rng(seed)
    thrust = np.repeat(HOVER + random.normal(0.0, 0.4, (40, 4)), 5, axis=0)
    start = {
        "initial_position": HIGH,
        "initial_velocity": random.normal(size=3),
        "initial_attitude": random.uniform(-0.5, 0.5, 3),
        "drag": drag,
    }
    wind = random.normal(size=3)
    found = fly(thrust, steps=200, wind=wind, **start)
    others = {"wind": wind, "force": np.zeros(3), "torque": np.zeros(3), "rate": "200 Hz", "steps": 200}
    expected = drive(Rotorcraft(model="rigid_body", **start), thrust=thrust, **others)
    tolerance = 5e-3 if drag else 1e-6
    assert np.abs(found.position - expected.position).max() < tolerance
    assert np.abs(found.velocity - expected.velocity).max() < tolerance
    assert np.abs(found.rates - expected.rates).max() < 1e-9
    assert np.abs(np.exp(1j * found.attitude) - np.exp(1j * expected.attitude)).max() < 1e-6


@pytest.mark.parametrize(
    ("rotor", "roll", "pitch", "yaw"), [(0, 0, 1, 1), (1, -1, 0, -1), (2, 0, -1, 1), (3, 1, 0, -1)]
)
def test_signs_of_the_rotors(rotor: int, roll: int, pitch: int, yaw: int) -> None:
    thrust = HOVER.copy()
    thrust[rotor] += 0.1
    rates = fly(thrust, steps=3).rates[-1]
    assert [int(np.sign(rate)) if abs(rate) > 1e-9 else 0 for rate in rates] == [roll, pitch, yaw]


@pytest.mark.parametrize("attitude", [(0.3, -0.2, 1.0), (-1.0, 1.2, -3.0), (0.0, 0.0, 3.1), (2.0, 0.1, 0.0)])
def test_it_starts_with_the_attitude_that_is_given(attitude: tuple[float, float, float]) -> None:
    assert fly(steps=1, initial_attitude=attitude).attitude[0] == pytest.approx(attitude, abs=1e-12)


def test_the_air_drags_it_along() -> None:
    carried = fly(wind=(3.0, -2.0, 0.5), steps=2001, drag=1.0)
    assert carried.velocity[-1] == pytest.approx([3.0, -2.0, 0.5], abs=1e-3)
    assert np.abs(fly(wind=(3.0, -2.0, 0.5), drag=0.0).velocity).max() < 1e-9


def test_a_floor_holds_it() -> None:
    fallen = fly(np.zeros(4), steps=601, initial_position=(0.0, 0.0, 0.5))
    assert fallen.position[-1] == pytest.approx([0.0, 0.0, 0.04], abs=2e-3)
    assert np.abs(fallen.velocity[-1]).max() < 1e-2


def test_a_period_of_several_time_steps_is_as_many_periods_of_one() -> None:
    thrust = np.repeat(HOVER + np.random.default_rng(1).normal(0.0, 0.2, (20, 4)), 4, axis=0)
    fine, coarse = fly(thrust, steps=80), fly(thrust[::4], steps=20, rate="50 Hz")
    assert coarse.position.tobytes() == fine.position[::4].tobytes()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<freejoint/>", "", "has no free joint"),
        ('general name="left"', 'general name="port"', "has no actuator 'left'; it needs front, right, rear"),
        ("<inertial", "<inertia", "MuJoCo refuses"),
        ("</mujoco>", "", "MuJoCo refuses"),
        ('<body name="craft">', LOOSE * 20 + '<body name="craft">', "numbers, 256 are the most"),
    ],
)
def test_a_model_that_is_none_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    assert words in refusal(model=edited(tmp_path, old, new))


def test_a_model_that_is_not_there_is_refused(tmp_path: Path) -> None:
    assert "there is no such file" in refusal(model=str(tmp_path / "none.xml"))


def test_a_period_that_the_time_steps_do_not_fill_is_refused() -> None:
    assert "time step, 0.005 s, does not divide the block's period, 0.008 s" in refusal(period=0.008)
    assert math.isnan(MujocoRotorcraft(model=str(MODEL)).period)


def test_without_the_package_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    found = builtins.__import__

    def missing(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "mujoco":
            raise ImportError("No module named 'mujoco'")
        return found(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    assert "install it with pip install 'quadvis[mujoco]'" in refusal()


def test_a_model_that_was_edited_is_another_diagram(tmp_path: Path) -> None:
    text = """\
quadvis: 1
name: x
rates: {physics: 200 Hz}
stop_time: 0.1 s
blocks:
  craft:
    block: plant.mujoco_rotorcraft
    rate: physics
    with: {model: edited.xml}
    in: {thrust: {value: [1, 1, 1, 1], unit: N}}
"""
    (tmp_path / "x.yaml").write_text(text)
    edited(tmp_path, 'mass="0.5"', 'mass="0.6"')
    before = quadvis.load(tmp_path / "x.yaml").hash
    edited(tmp_path, 'mass="0.5"', 'mass="0.7"')
    assert quadvis.load(tmp_path / "x.yaml").hash != before
    edited(tmp_path, "<freejoint/>", "")
    with pytest.raises(
        DiagramError, match=r"x\.yaml:9:\d+: block 'craft': model is not usable: .*no free joint"
    ):
        quadvis.load(tmp_path / "x.yaml")


@pytest.mark.slow
def test_the_hover_flies_in_it_as_closely_as_in_the_equations() -> None:
    """The same noise, the same laws, another simulator: the errors of 140 s are the same within 3 %."""
    ours, theirs = (
        quadvis.load(MODEL.parents[1] / name, variant=variant).run(engine="native")
        for name, variant in (("hover.yaml", "fused_geometric"), ("mujoco.yaml", None))
    )
    assert ours.passed and theirs.passed
    for label in ("xy", "h", "yaw"):
        expected = ours.outcome.summary[label]["rms"]
        assert theirs.outcome.summary[label]["rms"] == pytest.approx(expected, rel=0.03), label
