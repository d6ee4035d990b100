"""Every block of the library passes the conformance suite; a new one is covered without being named here."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis.block import Frame
from quadvis.library.catalogue import Catalogue
from quadvis.output.log import LogWriter
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.testing import drive
from quadvis.testing.conformance import CHECKS, Subject
from quadvis_blocks.vision.rendered_camera import RenderedCamera
from quadvis_vision.camera.calibration import CameraCalibration
from tests.blocks.firmware.faked import faked
from tests.blocks.hardware.can_frames import written
from tests.fmus import models
from tests.fmus.builder import fmu

ROOT = Path(__file__).parents[2]
PROTOCOL = str(ROOT / "diagrams" / "protocols" / "lab_imu.yaml")
SENT = (
    ("roll", 0),
    ("pitch", 0),
    ("rates", 3),
    ("position", 0),
    ("current", 0),
)  # values of its message, and their elements
CALIB = ROOT / "diagrams" / "calib"
CAMERA, COLOURS, PLANES = (str(CALIB / f"{name}.yaml") for name in ("camera", "colours", "two_planes"))


@pytest.fixture(scope="session")
def frames() -> list[Frame]:
    """What a camera sees from six places: the target whole, in part and not at all."""
    places = [
        [0.0, 0.0, 1.5],
        [0.2, -0.1, 1.4],
        [1.2, 0.3, 1.5],
        [0.1, 0.0, 1.6],
        [9.0, 9.0, 1.5],
        [0.0, 0.1, 1.5],
    ]
    camera = RenderedCamera(calibration=CAMERA)
    seen = drive(camera, position=places, attitude=np.zeros((6, 3)), rate="10 Hz").frame
    return [Frame.none(), *seen, seen[-1]]


@pytest.fixture(scope="session")
def centres() -> list[Any]:
    """Where four circles are in the picture: a square, a turned one, one with a circle missing, noise."""
    camera = CameraCalibration.load(CAMERA)
    square = np.array([[0.5, -0.5, 3.0], [0.5, 0.5, 3.0], [-0.5, 0.5, 3.0], [-0.5, -0.5, 3.0]])
    turned = square @ np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    partly = camera.project(square)
    partly[2] = np.nan
    noise = np.random.default_rng(1).uniform(0.0, 300.0, (4, 2))
    return [camera.project(square), camera.project(turned), partly, noise]


# Values by the names of the blocks, where one name has several meanings, or a block takes only some numbers.
PARAMETERS: dict[str, dict[str, Any]] = {
    "signal.lookup_1d": {"breakpoints": [-1.0, 0.5, 2.0], "values": [1.0, 3.0, -1.0]},
    "signal.lookup_2d": {
        "rows": [0.0, 1.0],
        "columns": [0.0, 0.5, 3.0],
        "values": [[1.0, 2.0, 0.0], [3.0, -1.0, 5.0]],
    },
    "systems.biquad": {"sections": [[0.25, -0.1, 0.05, 1.0, -1.2, 0.52], [1.0, 0.5, 0.0, 2.0, -0.4, 0.3]]},
    "systems.butterworth": {"corner": 1.0},
    "systems.fir": {"coefficients": [0.5, 0.3, 0.2]},
    "systems.kalman": {
        "A": [[1.0, 0.1], [0.0, 1.0]],
        "B": [[0.005], [0.1]],
        "C": [[1.0, 0.0], [0.5, 1.0]],
        "Q": [[1e-3, 0.0], [0.0, 1e-2]],
        "R": [[0.1, 0.01], [0.01, 0.2]],
    },
    "systems.lqr": {
        "A": [[0.0, 1.0], [0.0, 0.0]],
        "B": [[0.0], [1.0]],
        "Q": [[1.0, 0.0], [0.0, 1.0]],
        "R": [[0.5]],
    },
    "systems.spectrum": {"frequencies": [0.0, 1.0, 2.5], "samples": 4},
    "systems.state_space": {
        "A": [[0.0, 1.0], [-2.0, -0.5]],
        "B": [[0.0, 0.3], [1.0, 0.0]],
        "C": [[1.0, 0.0], [0.5, 1.0]],
        "D": [[0.0, 0.1], [0.0, 0.0]],
        "initial": [1.0, -1.0],
    },
    "systems.zero_pole_gain": {"zeros": "-1", "poles": "-2, -1+3j, -1-3j"},
    "systems.transfer_function": {"numerator": [1.0, 3.0], "denominator": [0.5, 1.2, 4.0]},
    "sources.repeating_sequence": {"times": [0.0, 0.25, 0.7], "values": [1.0, -1.0, 2.0]},
}
INPUTS: dict[str, dict[str, list[Any]]] = {
    "logic.multiport_switch": {"index": [0]},
    "math.function": {"u": [0.3, 0.5, 1.0, 0.75, 0.0625]},
    "math.modulo": {"divisor": [3.0, -2.0, 0.7]},
    "math.power": {"u": [0.3, 2.0, 7.5]},
    "signal.lookup_1d": {"u": [-1.0, 0.2, 2.0, 1.7]},
    "signal.lookup_2d": {"row": [0.0, 0.25, 1.0], "column": [3.0, 0.5, 1.1, 0.0]},
    "signal.select": {"index": [0, 2, 1]},
}


@pytest.fixture
def subject(request: pytest.FixtureRequest, frames: list[Frame], centres: list[Any]) -> Subject:
    """The block of a test, with values by their names in the library for what random numbers do not suit."""
    name = request.node.callspec.params["name"]
    block = Catalogue().find(name)
    values = {
        "calibration": CAMERA,
        "colours": COLOURS,
        "times": [0.0, 0.35, 1.0],
        "values": [[1.0, 2.0], [3.0, -1.0], [0.0, 0.0]],
        "during": [[0.3, 0.6]],
        "port": "pty:line",
        "device": "/dev/video0",
        "channels": [1, 3, 2],
        "lowest": [-1.0, 0.0, 1.0],
        "highest": [1.0, 1.0, -1.0],
        "initial": [0.0, 0.0, 0.5],
        "safe": [0.0, 0.0, 0.0],
        "roles": "stick throttle switch",
        "codes": "ABS_X ABS_Y BTN_TR",
        "dead_man": "BTN_TL",
        "shortest": [1000.0, 1000.0, 900.0],
        "longest": [2000.0, 2000.0, 2100.0],
        "ranges": [3, 3, 3],
        "scale": [1.0, 2.0, -0.5],
        "model": str(ROOT / "diagrams" / "models" / "rotorcraft.xml"),
    }
    values |= {
        f"{kind}_{key}": [0.0] * size if size else 0.0 for kind in ("initial", "safe") for key, size in SENT
    }
    told = {"protocol": PROTOCOL} if name.startswith("hardware.message_") else PARAMETERS.get(name, {})
    if name.startswith("hardware.can_"):
        told = {"protocol": written(request.getfixturevalue("tmp_path")), "message": "actuator"}
        values["port"] = "can:virtual:conformance"
    if name == "fmi.fmu":
        if shutil.which("gcc") is None:
            pytest.skip("compiles an FMU, with gcc")
        told = {"file": fmu(models.VAN_DER_POL)}
    if name == "firmware.betaflight":
        if shutil.which("gcc") is None:
            pytest.skip("compiles the clock of the firmware, with gcc")
        told = {"firmware": faked(*map(request.getfixturevalue, ("monkeypatch", "tmp_path")))}
    block = block.with_ports(told) if told else block
    if name == "hardware.digital_out":
        values["initial"] = [0, 1, 0]
    if name in ("mavlink.attitude_target", "mavlink.rate_target", "mavlink.manual_control"):
        values |= {"initial": [0.0, 0.0, 0.1, 0.5], "safe": [0.1, 0.0, 0.0, 0.0]}
    required = [key for key, param in block.interface.params.items() if param.required]
    if {"file", "folder"} & {*required}:  # few blocks read or write files, and all tests come by here
        folder = request.getfixturevalue("tmp_path")
        values |= {"folder": str(_pictures(folder)), "file": str(_video(folder / "video.avi"))}
    if name == "sources.recording":
        values |= {"file": str(_log(folder / "run.mcap")), "signal": "eyes.centres"}
    given = {key: values[key] for key in required if key not in told} | told
    if "latency" in block.interface.params:
        given["latency"] = 0.15
    inputs: dict[str, list[Any]] = dict(INPUTS.get(name, {}))
    if name.startswith("vision."):
        places = [[0.0, 0.0, 1.5], [0.1, -0.2, 1.4], [3.0, 0.0, 1.5]]
        inputs = {"position": places, "attitude": [[0.05, -0.03, 0.3]], "frame": frames, "centres": centres}
    suited = {key: series for key, series in inputs.items() if key in block.interface.inputs}
    return Subject(block, given, suited, ROOT.joinpath("tests", "blocks", *_test_path(name)))


def _test_path(name: str) -> tuple[str, ...]:
    *group, block = name.split(".")
    return (*group, f"test_{block}.py")


def _pictures(folder: Path) -> Path:
    for number in range(5):
        cv2.imwrite(str(folder / f"{number}.png"), np.full((6, 8, 3), 40 * number, np.uint8))
    return folder


def _video(path: Path) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for number in range(5):
        writer.write(np.full((48, 64, 3), 40 * number, np.uint8))
    writer.release()
    return path


def _log(path: Path) -> Path:
    block = RecordedBlock("/eyes", (RecordedPort("centres", shape=(4, 2), unit="px"),))
    with LogWriter(path, [block], {}) as writer:
        for number in range(5):
            writer.write(0, number * 10**8, np.full(8, 1.5 * number).tobytes())
    return path


NAMES = Catalogue().names()


# To compile takes seconds: this one stands for the rest in the first stage, beside the block of all kinds in
# tests/quadvis/test_compiled.py; the second stage compiles all.
CANARIES = ("signal.gain",)


def conformance() -> Iterator[Any]:
    """Yield every check of every block."""
    for name in NAMES:
        for check in CHECKS:
            later = check == "compiles" and name not in CANARIES and Catalogue().find(name).numeric
            yield pytest.param(name, check, marks=[pytest.mark.slow] * later, id=f"{name}-{check}")


def test_what_is_compiled_in_the_first_stage_can_be() -> None:
    assert all(Catalogue().find(name).numeric for name in CANARIES)


@pytest.mark.parametrize(("name", "check"), list(conformance()))
def test_every_block_conforms(name: str, check: str, subject: Subject) -> None:
    CHECKS[check](subject)


@pytest.mark.parametrize("check", ["starts_the_same", "repeats_after_restore", "returns_what_it_declares"])
@pytest.mark.parametrize("name", ["vision.pose_plane", "vision.pose_n_points"])
def test_both_poses_conform_with_a_camera_calibrated_on_two_planes(
    name: str, check: str, subject: Subject
) -> None:
    CHECKS[check](replace(subject, given={"calibration": PLANES, "rays": "two_planes"}))
