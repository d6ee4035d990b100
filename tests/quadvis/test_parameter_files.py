"""Parameter files: settings that are kept. Their faults are in `cases/parameter_files.yaml`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

import quadvis
from quadvis.cli import main
from quadvis.diagram.schema import diagram_schema
from quadvis.library.catalogue import Catalogue

DIAGRAM = """\
quadvis: 1
name: loop
rates: {fast: 10 Hz}
stop_time: 1 s
params: {size: 1 m}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $size}}
  law: {slot: true, block: signal.gain, rate: fast, with: {factor: 2}, in: {u: wave.y}}
variants:
  half: {slots: {law: {block: signal.gain, with: {factor: 0.5}}}}
"""
FILES = {
    "loop.yaml": DIAGRAM,
    "sets/s0.yaml": "{quadvis: 1, name: S0, doc: the least, set: {size: 3 m, law.factor: 5}}",
    "sets/s1.yaml": "{quadvis: 1, name: S1, base: s0.yaml, set: {law.factor: 6, wave.bias: 10 cm}}",
    "sets/low.yaml": "{quadvis: 1, name: low, set: {size: {value: 5, unit: cm}}}",
}
S0, S1, LOW = (f"sets/{name}.yaml" for name in ("s0", "s1", "low"))


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def values(*params: str, **more: Any) -> tuple[float, float, float]:
    """Return amplitude, bias and factor of a diagram loaded with parameter files."""
    graph = quadvis.load("loop.yaml", params=params, **more).graph
    wave = graph["wave"].block
    return wave.amplitude, wave.bias, graph["law"].block.factor


@pytest.mark.parametrize(
    ("params", "expected"),
    [
        ((), (1.0, 0.0, 2.0)),
        ((S0,), (3.0, 0.0, 5.0)),
        ((S1,), (3.0, 0.1, 6.0)),
        ((LOW,), (0.05, 0.0, 2.0)),
        ((S1, LOW), (0.05, 0.1, 6.0)),
        ((LOW, S1), (3.0, 0.1, 6.0)),
        ((S1, S0), (3.0, 0.1, 5.0)),
    ],
)
def test_files_apply_in_order_each_after_what_it_builds_on(
    params: tuple[str, ...], expected: tuple[float, ...]
) -> None:
    assert values(*params) == expected


def test_settings_win_over_files() -> None:
    assert values(S1, settings={"law.factor": 9}) == (3.0, 0.1, 9.0)
    assert values(S1, settings=["size=2 m"]) == (2.0, 0.1, 6.0)


def test_files_reach_what_a_variant_puts_in_a_slot() -> None:
    assert values(LOW, variant="half") == (0.05, 0.0, 0.5)
    assert values(S0, variant="half") == (3.0, 0.0, 5.0)


def test_one_file_need_not_be_a_list() -> None:
    loaded = [quadvis.load("loop.yaml", params=one) for one in (S0, Path(S0), [Path(S0)])]
    assert len({diagram.hash for diagram in loaded}) == 1
    assert [file.name for file in loaded[0].parameter_files] == ["S0"]


def test_the_hash_and_the_resolved_diagram_hold_the_values_whichever_way_they_came() -> None:
    by_file = quadvis.load("loop.yaml", params=[S0])
    by_hand = quadvis.load("loop.yaml", settings={"size": "3 m", "law.factor": 5})
    assert by_file.resolved == by_hand.resolved
    assert yaml.safe_load(by_file.resolved)["blocks"]["wave"]["with"]["amplitude"] == "3.0 m"
    assert by_file.hash != quadvis.load("loop.yaml").hash


def test_a_file_named_in_a_parameter_file_is_relative_to_that(project: Path) -> None:
    calibration = Path(__file__).parents[2] / "diagrams" / "calib" / "camera.yaml"
    (project / "sets" / "camera.yaml").write_bytes(calibration.read_bytes())
    (project / "pose.yaml").write_text(
        "{quadvis: 1, name: pose, rates: {fast: 10 Hz}, stop_time: 1 s, blocks: {"
        "pose: {block: vision.pose_n_points, rate: fast, with: {calibration: none.yaml},"
        "in: {centres: {value: [[1, 1], [2, 1], [2, 2], [1, 2]], unit: px}}}}}"
    )
    (project / "sets" / "real.yaml").write_text(
        "{quadvis: 1, name: real, set: {pose.calibration: camera.yaml}}"
    )
    (project / "top.yaml").write_text("{quadvis: 1, name: top, base: sets/real.yaml, set: {}}")
    for params in ("sets/real.yaml", "top.yaml"):
        found = quadvis.load("pose.yaml", params=params).graph["pose"].block.calibration
        assert Path(found).samefile(project / "sets" / "camera.yaml")


def test_a_run_tells_the_files_and_its_log_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "loop.yaml", "--params", S1, "--params", LOW]) == 0
    out = capsys.readouterr().out
    assert out.startswith("loop with S1, low: 1 s, seed 0\n")
    log = quadvis.read_log("runs/loop-S1-low.mcap")
    assert log.metadata["params"] == f"{S1}, {LOW}"
    assert main(["run", "loop.yaml", "--params", S1, "--params", LOW, "--json", "--log", ""]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["params"] == [S1, LOW]
    assert facts["hash"] == log.metadata["hash"]


def test_check_and_draw_take_them_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "loop.yaml", "--params", S1]) == 0
    assert main(["check", "loop.yaml", "--params", S1, "--variant", "half"]) == 0
    assert main(["draw", "loop.yaml", "--params", S1, "-o", "-"]) == 0
    capsys.readouterr()
    Path("sets/bad.yaml").write_text("{quadvis: 1, name: bad, set: {law.fctor: 6}}")
    for command in ("run", "check", "draw"):
        assert main([command, "loop.yaml", "--params", "sets/bad.yaml"]) == 2
        told = capsys.readouterr().err
        assert told.startswith("sets/bad.yaml:1:31: block 'law': signal.gain has no parameter 'fctor'")
        assert told.count("\n") == 1


def test_the_schema_takes_parameter_files_and_refuses_what_is_wrong_in_form() -> None:
    validator = Draft202012Validator(diagram_schema(Catalogue().load_all()[0]))
    for text in FILES.values():
        assert validator.is_valid(yaml.safe_load(text))
    right = yaml.safe_load(FILES[S1])
    wrong: list[dict[str, Any]] = [
        {"nme": "S"}, {"blocks": {}}, {"set": []}, {"set": {"wave.": 1}}, {"quadvis": 2}, {"rates": {}},
    ]  # fmt: skip
    for change in wrong:
        assert not validator.is_valid(right | change), change
    assert not validator.is_valid({key: value for key, value in right.items() if key != "name"})
