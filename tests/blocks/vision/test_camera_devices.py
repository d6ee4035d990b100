"""Which camera a name stands for, with the folders of Linux made up."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.machine.ports import PortError
from quadvis_vision.capture.devices import cameras, lasting_name, missing, stamps_start


def plug(system: Path, number: int, name: str, driver: str = "uvcvideo") -> None:
    """Let a camera have a number; it has a second node, for data about its pictures."""
    for index in (0, 1):
        entry = system / f"sys/class/video4linux/video{number + index}"
        entry.mkdir(parents=True)
        (entry / "index").write_text(f"{index}\n")
        (entry / "name").write_text(f"{name} camera\n")
        module = system / "sys/bus/drivers" / driver
        module.mkdir(parents=True, exist_ok=True)
        (entry / "device").mkdir()
        (entry / "device/driver").symlink_to(module)
        node = system / f"dev/video{number + index}"
        node.parent.mkdir(parents=True, exist_ok=True)
        node.touch()
        link = system / f"dev/v4l/by-id/usb-{name}-video-index{index}"
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(node)


def test_cameras_are_listed_by_their_lasting_names(tmp_path: Path) -> None:
    assert cameras(tmp_path) == []
    plug(tmp_path, 10, "right", "vivid")
    plug(tmp_path, 2, "left")
    left, right = cameras(tmp_path)
    assert (Path(left.node).name, left.title, left.driver) == ("video2", "left camera", "uvcvideo")
    assert Path(left.lasting).name == "usb-left-video-index0"
    assert stamps_start(left.lasting, tmp_path) and not stamps_start(right.lasting, tmp_path)


def test_a_number_stands_for_the_only_camera_and_is_refused_for_two(tmp_path: Path) -> None:
    plug(tmp_path, 0, "left")
    name = lasting_name("0", tmp_path)
    assert Path(name).name == "usb-left-video-index0"
    assert lasting_name(str(tmp_path / "dev/video0"), tmp_path) == name
    assert lasting_name("http://camera/", tmp_path) == "http://camera/"
    plug(tmp_path, 2, "right")
    with pytest.raises(
        PortError, match=r"camera 0 may be another one .* there are 2; name one of .*usb-left"
    ):
        lasting_name("0", tmp_path)
    assert "there are 2" in missing("0", tmp_path)


def test_a_camera_that_is_missing_is_reported_with_those_that_are_there(tmp_path: Path) -> None:
    assert missing("/dev/v4l/by-id/none", tmp_path) == (
        "camera '/dev/v4l/by-id/none' is missing; plug it in, or give the path of another one"
    )
    assert "video7' is missing" in missing("7", tmp_path)
    plug(tmp_path, 0, "left")
    assert "usb-left-video-index0" in missing("/dev/v4l/by-id/none", tmp_path)
    assert missing(str(tmp_path / "dev/video0"), tmp_path) == missing("rtsp://camera/1", tmp_path) == ""
