"""A check of the diagram finds every parameter that contradicts a block's period, at its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.api import check, load, load_text
from quadvis.errors import DiagramError, Fault

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
CAMERA = "vision.geometric_camera, rate: c, in: {position: [0 m, 0 m, 1 m], attitude: 0}"
RENDERED = CAMERA.replace("geometric", "rendered")
ROTORS = "estimation.rotor_state, rate: c, in: {thrust: [1 N, 1 N, 1 N, 1 N]}"
DELAY = 'signal.transport_delay, rate: c, in: {u: ["1"]}'


def faults(block: str, given: str, rate: str = "10 Hz") -> list[Fault]:
    """Return what is wrong with a block of some parameters at a rate."""
    block = block.replace("attitude: 0", "attitude: [0, 0, 0]")
    calibration = "calibration: calib/camera.yaml, " if block.startswith("vision") else ""
    entry = f"  x: {{block: {block}, with: {{{calibration}{given}}}}}\n"
    head = f"quadvis: 1\nname: x\nrates: {{c: {rate}}}\nsolver: {{step: 5 ms}}\nstop_time: 1 s\nblocks:\n"
    try:
        load_text(head + entry, DIAGRAMS)
    except DiagramError as error:
        return error.faults
    return []


@pytest.mark.parametrize(
    ("block", "given", "rate", "problem"),
    [
        (CAMERA, "latency: 5 s", "10 Hz", "latency must be at most 16 frames, 1.6 s, got 5 s"),
        (CAMERA, "latency: 1601 ms", "10 Hz", "latency must be at most 16 frames, 1.6 s, got 1.601 s"),
        (CAMERA, "latency: 1 s", "20 Hz", "latency must be at most 16 frames, 0.8 s, got 1 s"),
        (CAMERA, "latency: 7 s, every: 4", "10 Hz", "latency must be at most 16 frames, 6.4 s, got 7 s"),
        (RENDERED, "latency: 5 s", "10 Hz", "latency must be at most 16 frames, 1.6 s, got 5 s"),
        (RENDERED, "exposure_time: 200 ms", "10 Hz",
         "exposure_time must be at most the period, 0.1 s, got 0.2 s"),
        (RENDERED, "exposure_time: 60 ms", "20 Hz",
         "exposure_time must be at most the period, 0.05 s, got 0.06 s"),
        (DELAY, "delay: 1 s", "1 kHz", "delay must be at most 511 ticks of the block, 0.511 s, got 1 s"),
        (DELAY, "delay: 60 s", "10 Hz", "delay must be at most 511 ticks of the block, 51.1 s, got 60 s"),
        (DELAY.replace("rate: c", "rate: continuous"), "delay: 3 s", "10 Hz",
         "delay must be at most 511 ticks of the block, 2.555 s, got 3 s"),
        (ROTORS, "delay: 2 s", "100 Hz", "delay must be at most 127 ticks of the block, 1.27 s, got 2 s"),
        (ROTORS, "delay: 20 s", "10 Hz", "delay must be at most 127 ticks of the block, 12.7 s, got 20 s"),
    ],
)  # fmt: skip
def test_a_parameter_that_does_not_go_with_the_period_is_a_fault(
    block: str, given: str, rate: str, problem: str
) -> None:
    (fault,) = faults(block, given, rate)
    assert fault.problem.partition(";")[0] == problem
    assert (fault.subject, fault.place.line) == ("block 'x'", 7)


@pytest.mark.parametrize(
    ("block", "given", "rate"),
    [
        (CAMERA, "latency: 1.6 s", "10 Hz"),
        (CAMERA, "latency: 5 s", "2 Hz"),
        (RENDERED, "exposure_time: 100 ms", "10 Hz"),
        (DELAY, "delay: 511 ms", "1 kHz"),
        (ROTORS, "delay: 1.27 s", "100 Hz"),
    ],
)
def test_what_just_fits_the_period_is_none(block: str, given: str, rate: str) -> None:
    assert faults(block, given, rate) == []


def test_a_setting_that_does_not_go_with_the_period_is_found_in_a_variant() -> None:
    settings = {"eyes.latency": "5 s"}
    with pytest.raises(DiagramError, match=r"latency must be at most 16 frames, 1\.6 s, got 5 s"):
        load(DIAGRAMS / "hover.yaml", variant="geometric", settings=settings)
    with pytest.raises(DiagramError, match=r"latency must be at most 16 frames, 1\.6 s, got 5 s"):
        check(DIAGRAMS / "hover.yaml", settings)


def test_a_rate_that_is_wrong_tells_nothing_of_the_period() -> None:
    (fault,) = faults(CAMERA, "latency: 5 s", "10 s/m")
    assert "rate" not in fault.subject
    assert "latency" not in fault.problem


def test_a_file_that_is_no_video_is_found_at_check(tmp_path: Path) -> None:
    (tmp_path / "film.mp4").write_text("no film")
    text = "quadvis: 1\nname: x\nrates: {c: 10 Hz}\nstop_time: 1 s\nblocks:\n"
    with pytest.raises(DiagramError, match="is not a video that OpenCV can read"):
        load_text(text + "  x: {block: vision.video_file, rate: c, with: {file: film.mp4}}\n", tmp_path)


@pytest.mark.parametrize(
    ("block", "given", "file"),
    [
        ("vision.video_writer", "file: film.mp4", "film.mp4"),
        ("vision.frame_writer", "folder: .", "000001.png"),
    ],
)
def test_a_file_that_writing_would_destroy_is_found_at_check(
    block: str, given: str, file: str, tmp_path: Path
) -> None:
    (tmp_path / file).write_text("notes")
    text = "quadvis: 1\nname: x\nrates: {c: 10 Hz}\nstop_time: 1 s\nblocks:\n"
    text += "  in: {block: vision.image_folder, rate: c, with: {folder: shown}}\n"
    text += f"  x: {{block: {block}, rate: c, with: {{{given}}}, in: {{frame: in.frame}}}}\n"
    (tmp_path / "shown").mkdir()
    (tmp_path / "shown" / "1.png").write_bytes(b"no picture either")
    with pytest.raises(DiagramError, match="a file of another kind is there"):
        load_text(text, tmp_path)
