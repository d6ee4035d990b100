import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from tests.mounted import mounted, on_turntable
from tests.stages import mostly_slow

from .script import run_script

ROOT = Path(__file__).parents[2]
OFFSET, ANGLES = (0.12, -0.08, 0.06), (0.04, -0.05, 0.3)
DEGREE = math.pi / 180


def calibrate(*arguments: Any) -> Any:
    return run_script(ROOT / "tools" / "calibrate_mount", *arguments)


def flown(path: Path, duration: float, seed: int = 1, **settings: str) -> Path:
    log = path.with_suffix(".mcap")
    quadvis.load(path, settings=settings, stop_time=duration, seed=seed).run(log=log)
    return log


def found(*arguments: Any) -> Any:
    done = calibrate(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def scores(facts: Any, name: str, true: Any) -> Any:
    """Errors of what was estimated, in standard deviations."""
    pairs = zip(facts[name], true, facts[f"{name}_deviation"], strict=False)
    return np.array([(value - right) / deviation for value, right, deviation in pairs if deviation])


@pytest.fixture(scope="module")
def hover(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of 40 s of hover with noise."""
    return flown(mounted(tmp_path_factory.mktemp("hover"), "geometric", OFFSET, ANGLES), 40)


@pytest.fixture(scope="module")
def turn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a turn by 115 deg on a turntable with noise."""
    return flown(on_turntable(tmp_path_factory.mktemp("turn"), OFFSET, ANGLES, 0.1), 20)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a turn by 17 deg."""
    return flown(on_turntable(tmp_path_factory.mktemp("short"), OFFSET, ANGLES, 0.1), 3)


def refused(*arguments: Any) -> str:
    """Return the one sentence with which the program ends."""
    done = calibrate(*arguments)
    assert done.returncode == 2 and not done.stdout
    assert done.stderr.startswith("calibrate_mount: ") and done.stderr.count("\n") == 1
    return str(done.stderr)


def test_a_hover_gives_the_angles_and_a_turn_gives_the_offset(hover: Path, turn: Path) -> None:
    facts = found(hover, "--turn", turn, "--up", "6 cm")
    assert np.abs(scores(facts, "angles", ANGLES)).max() < 3
    assert np.all(np.array(facts["angles_deviation"]) < np.array((0.5, 0.5, 3.0)) * DEGREE)
    assert np.abs(scores(facts, "offset", OFFSET)).max() < 3
    assert max(facts["offset_deviation"]) < 0.02
    assert facts["offset"][2] == 0.06 and facts["frames"] > 350 and facts["warnings"] == []


@pytest.mark.parametrize("seed", mostly_slow(range(2, 8), quick=0))
def test_so_do_other_flights(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.append(rng.uniform(-0.08, 0.08, 2), rng.uniform(-3, 3)).tolist()
    offset = rng.uniform(-0.2, 0.2, 3).tolist()
    # The loop would not bear a camera that is turned by much, so the estimate knows its yaw.
    known = {"estimate.mount_angles": f"{{value: [0, 0, {angles[2]}], unit: rad}}"}
    hover = flown(mounted(tmp_path / "a", "geometric", offset, angles), 120, seed, **known)
    turn = flown(on_turntable(tmp_path / "b", offset, angles, -0.07), 40, seed)
    facts = found(hover, "--turn", turn, "--up", f"{offset[2]} m")
    assert np.abs(scores(facts, "angles", angles)).max() < 3
    assert np.abs(scores(facts, "offset", offset)).max() < 3


def test_the_report_has_the_settings_for_a_diagram(hover: Path, turn: Path) -> None:
    done = calibrate(hover, "--turn", turn, "--up", "6 cm")
    facts = found(hover, "--turn", turn, "--up", "6 cm")
    settings = dict(
        line.removeprefix("--set '").removesuffix("'").split("=", 1)
        for line in done.stdout.splitlines()
        if line.startswith("--set ")
    )
    block = quadvis.load(ROOT / "diagrams" / "hover.yaml", settings=settings).graph["estimate/craft"].block
    assert block.angles == pytest.approx(facts["angles"], abs=0.006 * DEGREE)
    assert block.offset == pytest.approx(facts["offset"], abs=6e-5)
    assert (
        f"yaw     {facts['angles'][2] / DEGREE:9.2f} +- {facts['angles_deviation'][2] / DEGREE:.2f} deg"
        in done.stdout
    )
    assert "up           6.00 cm, not estimated" in done.stdout and not done.stderr


def test_a_yaw_that_the_tilts_do_not_determine_is_a_warning(tmp_path: Path) -> None:
    facts = found(flown(mounted(tmp_path, "geometric", OFFSET, ANGLES), 3), "--stamp", "eyes/camera.stamp")
    (warning,) = facts["warnings"]
    assert warning.startswith("the tilts do not determine the yaw of the mount (standard deviation ")
    assert facts["angles"][2] == facts["angles_deviation"][2] == 0.0 and facts["angles_deviation"][0] > 0.0
    assert np.abs(scores(facts, "angles", ANGLES)).max() < 3


def test_a_yaw_that_is_given_counts(short: Path, hover: Path) -> None:
    facts = found(hover, "--yaw", f"{ANGLES[2]} rad")
    assert facts["angles"][2] == ANGLES[2] and facts["angles_deviation"][2] == 0.0
    assert np.abs(scores(facts, "angles", ANGLES)).max() < 3
    done = calibrate(short, "--yaw", "17 deg")
    assert "yaw         17.00 deg, not estimated" in done.stdout and not done.stderr


def test_a_heading_that_does_not_turn_enough_is_a_warning_and_no_offset(hover: Path, short: Path) -> None:
    done = calibrate(hover, "--turn", short)
    assert done.returncode == 0 and "mount_offset" not in done.stdout and "forward" not in done.stdout
    assert done.stderr.startswith("warning: the heading turns by ")
    assert done.stderr.endswith("show the offset; turn the craft by 60 deg or more\n")


def test_the_angles_do_not_need_a_turn(hover: Path) -> None:
    done = calibrate(hover)
    assert done.returncode == 0 and not done.stderr
    assert "mount_angles" in done.stdout and "mount_offset" not in done.stdout


def test_a_pose_with_the_tilt_of_the_inertial_unit_is_refused(tmp_path: Path) -> None:
    log = flown(mounted(tmp_path, "fused_geometric", OFFSET, ANGLES), 1)
    assert "has a covariance, as vision.pose_imu has" in refused(log)


def test_too_few_frames_are_refused(tmp_path: Path) -> None:
    log = flown(mounted(tmp_path, "geometric", OFFSET, ANGLES), 1)
    assert "frames with a pose and a tilt; give a log with 20 or more" in refused(log)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--pose", "poze"), "there is no signal 'poze.roll'; did you mean 'pose.roll'?"),
        (("--imu", "craft"), "there is no signal 'craft.roll'"),
        (("--stamp", "eyes.centres"), "'eyes.centres' has the shape [4, 2], not []; name another"),
        (("--yaw", "17"), "'17' has no unit; did you mean '17 deg'"),
        (("--up", "6 deg"), "6 deg"),
    ],
)
def test_bad_arguments_end_with_a_sentence(short: Path, arguments: Any, words: str) -> None:
    assert words in refused(short, *arguments)


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_text("no log")
    assert "was not written by quadvis" in refused(tmp_path / "x.mcap")
    assert "there is no such file" in refused(tmp_path / "y.mcap")


def test_a_log_that_was_cut_short_is_used_with_a_warning(hover: Path, tmp_path: Path) -> None:
    data = hover.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 3 // 4])
    done = calibrate(tmp_path / "cut.mcap")
    assert done.returncode == 0 and done.stderr.startswith("warning: the log ") and "cut short" in done.stderr


def test_the_program_can_be_started() -> None:
    assert os.access(ROOT / "tools" / "calibrate_mount", os.X_OK)
