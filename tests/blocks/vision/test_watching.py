"""The diagrams that write what the camera saw and what was found as videos and pictures."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

import quadvis
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[3] / "diagrams"
FLIGHT = """\
quadvis: 1
name: watched
rates: {{vision: 10 Hz}}
stop_time: 2 s
blocks:
  position: {{block: sources.constant, rate: vision, with: {{value: {{value: [0.2, -0.1, 1.5], unit: m}}}}}}
  eyes:
    part: {part}
    rate: vision
    with: {{video: {video}}}
    in:
      position: position.y
      attitude: {{value: [0, 0, 0.3], unit: rad}}
      pose_position: pose.position
      rotation: pose.rotation
      yaw: pose.yaw
      valid: pose.valid
  pose:
    block: vision.pose_n_points
    rate: vision
    with: {{calibration: {camera}}}
    in: {{centres: eyes.centres}}
"""


def read(path):
    video = cv2.VideoCapture(str(path))
    pictures = []
    while (frame := video.read())[0]:
        pictures.append(frame[1])
    return pictures


@pytest.mark.parametrize("variant", mostly_slow(["video", None]))
def test_a_recording_is_written_with_what_was_found_in_it(tmp_path, variant):
    file = tmp_path / "watch.mkv"
    result = quadvis.load(DIAGRAMS / "watch.yaml", variant=variant, settings={"writer.file": str(file)}).run()
    pictures = read(file)
    assert len(pictures) == result["detector.fresh"].sum() == 30
    # Twice as large as the pictures, and a caption below.
    assert pictures[0].shape[1] == 904 and pictures[0].shape[0] > 644
    # Something dark and something bright, the cross, is drawn at every circle's centre but the black one's.
    for picture, centres in zip(pictures, result["detector.centres"], strict=True):
        for u, v in np.rint((centres[:3] + 0.5) * 2 - 0.5).astype(int):
            assert np.ptp(picture[v - 8 : v + 9, u - 8 : u + 9].sum(axis=2).astype(int)) > 250


@pytest.mark.slow
def test_a_recording_is_written_as_pictures(tmp_path):
    quadvis.load(DIAGRAMS / "watch.yaml", variant="pictures", settings={"writer.folder": str(tmp_path)}).run()
    paths = sorted(tmp_path.iterdir())
    assert [path.name for path in paths] == [f"{number:06d}.png" for number in range(1, 31)]
    assert cv2.imread(str(paths[0])).shape[1] == 904


def test_the_watched_eyes_of_a_flight_write_a_video_in_its_time(tmp_path):
    diagram, file = tmp_path / "flight.yaml", tmp_path / "flight.mp4"
    part, camera = DIAGRAMS / "parts" / "watched_eyes.yaml", DIAGRAMS / "calib" / "camera.yaml"
    diagram.write_text(FLIGHT.format(part=part, video=file, camera=camera))
    result = quadvis.load(diagram).run()
    assert result["pose.valid"][1:].all()
    pictures = read(file)
    assert len(pictures) == 21
    assert not pictures[0].any()  # 100 ms of latency
    assert pictures[1].mean() > 100


def test_watched_eyes_see_what_the_rendered_ones_see():
    plain, watched = (
        yaml.safe_load((DIAGRAMS / "parts" / name).read_text())
        for name in ("rendered_eyes.yaml", "watched_eyes.yaml")
    )
    assert watched["ports"]["out"] == plain["ports"]["out"]
    assert watched["params"].items() >= plain["params"].items()
    assert watched["blocks"].items() >= plain["blocks"].items()
