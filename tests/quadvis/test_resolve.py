"""The diagram written out: it loads again and gives the same run; its hash is the experiment's alone."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from quadvis.api import Diagram, load, load_text
from quadvis.diagram.sections.figures import read_figures
from quadvis.document import parse_yaml
from quadvis.errors import DiagramError
from quadvis.output.log_reader import read_log
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"


def copied(folder: Path) -> Path:
    """Return a copy of the hover and its parts in a folder."""
    shutil.copytree(DIAGRAMS, folder, ignore=shutil.ignore_patterns("recordings", "pictures"))
    return folder / "hover.yaml"


def same(diagram: Diagram, again: Diagram) -> None:
    """Require that two diagrams are one."""
    assert again.resolved == diagram.resolved
    assert again.hash == diagram.hash


@pytest.mark.parametrize("variant", mostly_slow(["geometric", "plane", None]))
def test_the_hover_written_out_gives_the_same_run_to_the_bit(variant: str | None) -> None:
    diagram = load(
        DIAGRAMS / "hover.yaml", variant=variant, settings=["bandwidth=1 rad/s"], stop_time="1 s", seed=3
    )
    again = load_text(diagram.resolved, DIAGRAMS)
    same(diagram, again)
    first, second = diagram.run(), again.run()
    assert list(first) == list(second)
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])
        np.testing.assert_array_equal(first.times(name), second.times(name))
    assert first.outcome == second.outcome


@pytest.mark.parametrize("path", sorted(DIAGRAMS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_diagram_written_out_is_itself_again(path: Path) -> None:
    diagram = load(path)
    same(diagram, load_text(diagram.resolved, path.parent))


def test_the_log_of_a_run_loads_as_its_diagram(tmp_path: Path) -> None:
    diagram = load(DIAGRAMS / "hover.yaml", variant="geometric", stop_time="0.1 s")
    diagram.run(log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    same(diagram, load_text(log.diagram, DIAGRAMS))
    assert log.metadata["hash"] == diagram.hash


def test_the_hash_does_not_depend_on_where_the_diagram_lies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    near, far = copied(tmp_path / "near"), copied(tmp_path / "far" / "away")
    hashes = {load(near).hash, load(far).hash}
    monkeypatch.chdir(tmp_path / "far")
    hashes |= {
        load("away/hover.yaml").hash,
        load("../near/hover.yaml").hash,
        load("away/../away/hover.yaml").hash,
    }
    monkeypatch.chdir(far.parent)
    hashes |= {load("hover.yaml").hash}
    assert len(hashes) == 1
    assert str(tmp_path) not in load(far).resolved


@pytest.mark.parametrize(
    "change",
    [{"seed": 3}, {"stop_time": "2 s"}, {"variant": "plane"}, {"settings": ["bandwidth=1 rad/s"]},
     {"settings": ["eyes.latency=90 ms"]}, {"settings": ["control/roll.gravity=9.8 m/s^2"]}],
)  # fmt: skip
def test_the_hash_changes_with_whatever_changes_the_run(change: dict[str, object]) -> None:
    path = DIAGRAMS / "hover.yaml"
    assert load(path, **change).hash != load(path).hash  # type: ignore[arg-type]


def test_the_hash_does_not_change_with_words(tmp_path: Path) -> None:
    path = copied(tmp_path / "copy")
    before = load(path).hash
    path.write_text("# A comment.\n" + path.read_text().replace("\ndoc: The paper's", "\ndoc: Our"))
    assert load(path).hash == before


def test_a_calibration_file_is_part_of_the_hash(tmp_path: Path) -> None:
    path = copied(tmp_path / "copy")
    written = load(path).resolved
    camera = path.parent / "calib" / "camera.yaml"
    camera.write_text(camera.read_text().replace("430", "431"))
    assert load(path).resolved != written
    with pytest.raises(DiagramError, match=r"file 'calib/camera.yaml' is not what it was"):
        load_text(written, path.parent)
    camera.unlink()
    with pytest.raises(DiagramError, match=r"there is no file 'calib/camera.yaml'"):
        load_text(written, path.parent)


def test_a_folder_that_a_run_writes_is_no_part_of_the_hash(tmp_path: Path) -> None:
    path = copied(tmp_path / "copy").with_name("record.yaml")
    before = load(path).hash
    written = path.parent.parent / "runs" / "hand_held"
    written.mkdir(parents=True)
    (written / "000001.jpg").write_bytes(b"\xff\xd8\xff, an earlier picture")
    assert load(path).hash == before


CASE = """\
quadvis: 1
name: case
rates: {fast: 100 Hz, shifted: {rate: 1/30 s, offset: 70 ms}}
solver: {step: 1/600 s, method: ode2}
stop_time: 0.5 s
log: {signals: [mixed, "integral*"], every: {shifted: 2}}
blocks:
  mixed: {block: sources.constant, rate: fast, with: {value: [1 m, 20 deg, 3]}}
  table: {block: sources.constant, rate: fast, with: {value: [[1 m, 2 s], [3 m, 4 s]]}}
  delay: {block: signal.unit_delay, rate: fast, with: {initial: 0}, in: {u: "mixed.y[0]"}}
  gain: {block: signal.gain, rate: fast, with: {factor: 0.1 N/m}, in: {u: delay.y}}
  sum: {block: signal.sum, rate: fast, in: {u: [gain.y, 2 kN, {from: sum.y, across: delay}]}}
  integral: {block: signal.integrator, in: {u: {from: sum.y, across: hold}}}
  late: {block: signal.gain, rate: shifted, in: {u: {from: integral.y, across: sample}}}
  later: {block: signal.transport_delay, rate: fast, with: {initial: 3 m}, in: {u: "mixed.y[0:1]"}}
summary: {"a 1": integral.y, "true": {signal: "mixed.y[1:2]", show: [mean], unit: deg}}
expect: [{signal: integral.y, within: 1e6 N*s, after: 1 ms}]
"""


def test_units_that_wires_decide_are_written_out(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(CASE)
    diagram = load(tmp_path / "case.yaml")
    same(diagram, load_text(diagram.resolved, tmp_path))
    root = parse_yaml(diagram.resolved)
    written = root.to_python()["blocks"]
    assert written["gain"]["with"] == {"factor": "0.1 N/m"}
    assert written["delay"]["with"] == {"initial": "0.0 m"}
    assert written["sum"]["in"]["u"][1] == "2000.0 N"
    assert written["mixed"]["with"]["value"]["unit"] == "m rad 1"
    assert written["table"]["with"]["value"] == [["1.0 m", "2.0 s"], ["3.0 m", "4.0 s"]]
    assert root.to_python()["rates"]["shifted"] == {"rate": "1/30 s", "offset": "7/100 s"}
    first, second = diagram.run(), load_text(diagram.resolved, tmp_path).run()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


PARTS = """\
quadvis: 1
name: case
rates: {fast: 100 Hz}
stop_time: 0.1 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m}}
  bare: {part: outer.yaml, rate: fast, in: {u: wave.y}}
  full: {part: outer.yaml, rate: fast, in: {u: wave.y, stamp: {value: 0, unit: s}, valid: false, size: 3 m}}
summary: {rate: bare.rate, far: bare/far.y}
expect: [{signal: full/inner/slope.ok, count: 0}]
"""
OUTER = """\
quadvis: 1
name: outer
ports: {in: [u, stamp, valid, {size: 2 m}], out: {rate: inner.rate}}
blocks:
  inner: {part: inner.yaml, in: {u: in.u, stamp: in.stamp, valid: in.valid}}
  far: {block: signal.gain, in: {u: in.size}}
"""
INNER = """\
quadvis: 1
name: inner
ports: {in: [u, stamp, valid], out: {rate: slope.rate}}
blocks:
  slope: {block: signal.derivative, in: {u: in.u, stamp: in.stamp, valid: in.valid}}
"""
FLAT = PARTS.replace("bare.rate", "bare/inner/slope.rate").replace(
    "  bare: {part: outer.yaml, rate: fast, in: {u: wave.y}}\n",
    "  bare/inner/slope: {block: signal.derivative, rate: fast, in: {u: wave.y}}\n"
    "  bare/far: {block: signal.gain, rate: fast, in: {u: 2 m}}\n",
)


def test_an_open_input_of_a_part_leaves_its_readers_open(tmp_path: Path) -> None:
    for name, text in {"case": PARTS, "outer": OUTER, "inner": INNER, "flat": FLAT}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    diagram, flat = load(tmp_path / "case.yaml"), load(tmp_path / "flat.yaml")
    same(diagram, flat)
    assert diagram.draw() == flat.draw()
    result = diagram.run()
    assert result.passed
    np.testing.assert_array_equal(result["bare/far.y"], np.full(11, 2.0))
    np.testing.assert_array_equal(result["full/far.y"], np.full(11, 3.0))
    assert np.abs(result["bare.rate"][1:]).min() > 0.1
    np.testing.assert_array_equal(result["full.rate"], np.zeros(11))


ASKED = """\
quadvis: 1
name: asked
params: {target: {value: [0, 1.5], unit: m m}, late: 0.5 s, most: 20 cm}
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  height: {block: sources.constant, rate: fast, with: {value: 1.6 m}}
expect: [{signal: height.y, of: "$target[1]", after: $late, within: $most}]
summary: {height: {signal: height.y, of: "$target[1]", show: [max]}}
figures: [{title: height, from: $late, signals: height.y, unit: cm, reference: "$target[1]"}]
"""


def test_a_run_is_judged_against_the_parameters_of_its_diagram(tmp_path: Path) -> None:
    (tmp_path / "asked.yaml").write_text(ASKED)
    diagram = load(tmp_path / "asked.yaml")
    assert diagram.warnings == ()  # each parameter is used
    assert str(diagram.expectations[0]) == "height.y within 20 cm of 150 cm after 0.5 s"
    assert diagram.run().passed
    other = load(tmp_path / "asked.yaml", settings=["target=[0 m, 1.3 m]"])
    result = other.run()
    assert not result.passed and result.outcome.summary["height"]["max"] == pytest.approx(0.3)
    assert other.hash != diagram.hash
    same(other, load_text(other.resolved, tmp_path))
    (figure,) = read_figures(other.resolved, "log")
    assert (figure.start, figure.panels[0].reference) == (0.5, pytest.approx(130.0))
