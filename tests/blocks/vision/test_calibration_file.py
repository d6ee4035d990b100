"""Files that are no calibrations are refused in one sentence that quotes nothing from them."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.errors import QuadvisError
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.homogeneous import read_correspondences
from quadvis_vision.camera.two_planes import TwoPlanesCalibration
from quadvis_vision.detection.colours import ColourCalibration

CALIB = Path(__file__).parents[3] / "diagrams" / "calib"
READERS: dict[str, Callable[[Path], Any]] = {
    "a camera calibration": CameraCalibration.load,
    "a two-planes calibration": TwoPlanesCalibration.load,
    "a file of colours": ColourCalibration.load,
}
OTHERS = {
    "accounts": "root:SECRET:0:0:SECRET:/root:/bin/sh\nSECRET:x:1:1::/:\n",
    "map": "user: SECRET\npassword: SECRET\n",
    "map with other keys": "resize: SECRET\nsizes: SECRET\na size: SECRET\nSECRET: 1\n",
    "nested": "a:\n  size: 1\n  matrix: 2\n  distortion: 3\n  SECRET: 4\n",
    "JSON": '{"password": "SECRET", "SECRET": [1, 2, "SECRET"]}',
    "list": "- SECRET\n- SECRET\n",
    "key file": "-----BEGIN SECRET KEY-----\nSECRETSECRET==\n-----END SECRET KEY-----\n",
    "settings": "[SECRET]\nSECRET = SECRET\n",
    "shell": "export SECRET='SECRET: x'\nif [ $SECRET ]; then SECRET; fi\n",
    "doubled key": "SECRET: 1\nSECRET: 2\n",
    "alias": "a: *SECRET\nb: &SECRET 1\nc: !SECRET 2\n",
    "second document": "SECRET: 1\n---\nSECRET: 2\n",
    "quotes": 'a: "SECRET\nb: SECRET\n',
    "indexed": "a: {SECRET: SECRET[0], b: c}\n",
    "tab": "a:\n\tSECRET: 1\n",
    "escape": 'a: "SECRET\\q"\n',
    "control": "SECRET: \x07SECRET\n",
    "not text": b"SECRET: \xff\xfeSECRET\n",
    "table": "x,y,z\n1,2,SECRET\n",
    "one word": "SECRET",
    "directive": "%SECRET 1\n---\na: 1\n",
    "deep": "SECRET: " + "[" * 99,
}


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("kind", READERS)
def test_nothing_of_another_file_is_shown(tmp_path: Path, kind: str, other: str) -> None:
    text = OTHERS[other]
    (tmp_path / "other").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(QuadvisError) as caught:
        READERS[kind](tmp_path / "other")
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'other'}: this is not {kind}; that has the keys ")
    assert "SECRET" not in said and "\n" not in said


@pytest.mark.parametrize("other", OTHERS)
def test_nothing_of_another_file_is_shown_as_a_table_of_points(tmp_path: Path, other: str) -> None:
    text = OTHERS[other]
    (tmp_path / "other").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(QuadvisError) as caught:
        read_correspondences(tmp_path / "other")
    assert "SECRET" not in str(caught.value)


@pytest.mark.parametrize("reader", [*READERS.values(), read_correspondences])
def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path, reader: Callable[[Path], Any]) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path, tmp_path / "absent", Path("/dev/zero")):
        with pytest.raises(QuadvisError) as caught:
            reader(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)


DIAGRAM = """\
quadvis: 1
name: case
rates: {vision: 10 Hz}
stop_time: 1 s
blocks:
  recording: {block: vision.image_folder, rate: vision, with: {folder: pictures}}
  detector:
    block: vision.circle_detector
    rate: vision
    with: {colours: ../secret, calibration: ../secret}
    in: {frame: recording.frame}
  pose:
    block: vision.pose_imu
    rate: vision
    with: {calibration: ../secret}
    in: {centres: detector.centres}
"""


@pytest.mark.parametrize("other", ["accounts", "map", "JSON", "shell", "doubled key", "not text"])
def test_nothing_of_another_file_is_shown_by_the_check_of_a_diagram(tmp_path: Path, other: str) -> None:
    text = OTHERS[other]
    (tmp_path / "secret").write_bytes(text if isinstance(text, bytes) else text.encode())
    (tmp_path / "project" / "pictures").mkdir(parents=True)
    (tmp_path / "project" / "pictures" / "1.png").touch()
    (tmp_path / "project" / "case.yaml").write_text(DIAGRAM)
    with pytest.raises(QuadvisError) as caught:
        quadvis.load(tmp_path / "project" / "case.yaml")
    assert "this is not a camera calibration" in str(caught.value)
    assert "SECRET" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("camera", "matrix:", "matrx:", "did you mean 'matrix'?"),
        ("camera", "[452, 322]", "[452, wide]", "'wide'"),
        ("camera", "distortion: [", "distortion: [[", "camera.yaml:"),
        ("colours", "colour: red", "color: red", "'color'"),
        ("two_planes", "projective: false", "projective: no way", "'no way'"),
    ],
)
def test_a_slip_in_a_calibration_is_still_shown(
    tmp_path: Path, name: str, old: str, new: str, said: str
) -> None:
    text = (CALIB / f"{name}.yaml").read_text()
    assert old in text
    (tmp_path / f"{name}.yaml").write_text(text.replace(old, new, 1))
    reader = dict(zip(("camera", "two_planes", "colours"), READERS.values(), strict=True))[name]
    with pytest.raises(QuadvisError) as caught:
        reader(tmp_path / f"{name}.yaml")
    assert said in str(caught.value) and ":" in str(caught.value)
