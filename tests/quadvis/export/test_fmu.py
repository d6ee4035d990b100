"""Exported FMUs: fmpy finds no problem in them, and they give our numbers in fmpy and in our own block."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import Diagram, load_text
from quadvis.block import ParameterError
from quadvis.cli import main
from quadvis.errors import QuadvisError, RunError
from quadvis.export.package import OPTIONS
from quadvis.host.packing import pack
from quadvis.testing import check_block, drive
from quadvis_blocks.fmi.fmu import Fmu
from tests.fmus.builder import needs_gcc

pytestmark = needs_gcc
BOTH = pytest.mark.parametrize("version", [2, pytest.param(3, marks=pytest.mark.slow)])
HOVER = Path(__file__).parents[3] / "diagrams" / "hover.yaml"
LAW = """\
quadvis: 1
name: law
doc: A proportional law, and what it has commanded before.
params: {gain: 3 1/s}
ports: {in: [error], out: {command: scaled.y, late: memory.y}}
blocks:
  scaled: {block: signal.gain, with: {factor: $gain}, in: {u: in.error}}
  memory: {block: signal.unit_delay, in: {u: scaled.y}}
"""
LOOP = """\
quadvis: 1
name: loop
rates: {fast: 100 Hz, slow: 20 Hz}
solver: {method: ode4, step: 5 ms}
stop_time: 2 s
blocks:
  reference: {block: sources.step, rate: fast, with: {at: 0.5 s, after: 1 m}}
  error:
    block: signal.difference
    rate: fast
    in: {plus: reference.y, minus: {from: plant.y, across: sample}}
  law: {block: signal.gain, rate: slow, with: {factor: 3 1/s}, in: {u: {from: error.y, across: sample}}}
  late: {block: signal.unit_delay, rate: slow, in: {u: law.y}}
  plant: {block: signal.integrator, in: {u: {from: late.y, across: hold}}}
"""


@pytest.fixture(scope="module")
def loop() -> Diagram:
    return load_text(LOOP)


@pytest.fixture(scope="module")
def whole(loop: Diagram, tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return _Whole(loop, tmp_path_factory.mktemp("whole"))


class _Whole(dict[int, Path]):
    """The whole loop as FMUs, each made when it is asked for."""

    def __init__(self, loop: Diagram, folder: Path) -> None:
        self._loop, self._folder = loop, folder

    def __missing__(self, version: int) -> Path:
        path = self[version] = self._folder / f"loop{version}.fmu"
        self._loop.export_fmu(".", path, version=version)
        return path


def by_fmpy(path: Path, stop: float, step: float, **more: Any) -> Any:
    from fmpy import simulate_fmu

    return simulate_fmu(str(path), stop_time=stop, step_size=step, output_interval=step, **more)


@BOTH
def test_fmpy_finds_no_problem_and_simulates_it_to_our_bits(
    version: int, whole: dict[int, Path], loop: Diagram
) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(whole[version])) == []
    found, ours = by_fmpy(whole[version], 2.0, 0.005), loop.run()
    for name, every in (("plant.y", 1), ("error.y", 2), ("reference.y", 2), ("law.y", 10), ("late.y", 10)):
        assert np.array_equal(found[name][::every], ours[name]), name


SLIDING = """\
quadvis: 1
name: sliding
solver: {method: ode4, step: 20 ms}
stop_time: 2 s
blocks:
  mass:
    block: plant.sliding_mass
    with: {mass: 2 kg, coulomb: 3 N, breakaway: 5 N, surface: 0.2 m/s}
    in: {force: spring.y}
  spring: {block: signal.gain, rate: continuous, with: {factor: -50 N/m}, in: {u: mass.x}}
  ball:
    block: signal.second_order_integrator
    with: {initial: 1 m, lower: 0 m, restitution: 0.7}
    in: {u: -9.81 m/s^2}
  relay:
    block: signal.relay
    rate: continuous
    with: {on_at: 0.11 m, off_at: -0.11 m, on_value: -1 m/s, off_value: 1 m/s}
    in: {u: place.y}
  place: {block: signal.integrator, in: {u: relay.y}}
"""

AT_TIMES = """\
rates: {slow: 5 Hz}
"""
UNDER_A_CONDITION = """\
  on: {block: sources.clock, rate: slow}
  runs: {block: logic.compare, rate: slow, with: {operator: "<"}, in: {a: on.y, b: 1.3 s}}
  caught:
    block: signal.second_order_integrator
    when: {from: runs.y, across: hold}
    with: {initial: 1 m, lower: 0 m, restitution: 0.7}
    in: {u: -9.81 m/s^2}
"""


@BOTH
def test_events_between_ticks_have_our_bits(version: int, tmp_path: Path) -> None:
    diagram = load_text(SLIDING)
    diagram.export_fmu(".", tmp_path / "sliding.fmu", version=version)
    found, ours = by_fmpy(tmp_path / "sliding.fmu", 2.0, 0.02), diagram.run(keep=("*",))
    for name in ("mass.x", "mass.v", "mass.mode", "ball.x", "ball.v", "relay.y", "place.y"):
        assert np.array_equal(found[name], ours[name]), name
    assert set(ours["mass.mode"].tolist()) == {-1, 0}


def test_no_event_comes_while_a_block_does_not_run(tmp_path: Path) -> None:
    head, blocks = SLIDING.split("blocks:\n")
    diagram = load_text(f"{head}{AT_TIMES}blocks:\n{blocks}{UNDER_A_CONDITION}")
    diagram.export_fmu(".", tmp_path / "caught.fmu")
    found, ours = by_fmpy(tmp_path / "caught.fmu", 2.0, 0.02), diagram.run(keep=("*",))
    for name in ("caught.x", "caught.v", "ball.x"):
        assert np.array_equal(found[name], ours[name]), name
    assert len(set(ours["caught.x"][70:].tolist())) == 1 < len(set(ours["caught.x"][:60].tolist()))


@pytest.mark.slow
def test_chatter_ends_the_simulation_of_an_fmu(tmp_path: Path) -> None:
    text = SLIDING.replace("on_at: 0.11 m, off_at: -0.11 m", "on_at: 1e-5 m, off_at: -1e-5 m")
    load_text(text).export_fmu(".", tmp_path / "chatter.fmu")
    with pytest.raises(RunError, match="more events within one step than can be meant"):
        drive(Fmu(file=str(tmp_path / "chatter.fmu"), isolation="none"), rate="20 ms", steps=5)


@BOTH
def test_our_own_block_gives_the_same_bits(version: int, whole: dict[int, Path], loop: Diagram) -> None:
    block = Fmu(file=str(whole[version]), isolation="none")
    assert {name: port.unit for name, port in block.interface.outputs.items()} == {
        "reference_y": "m", "error_y": "m", "law_y": "m/s", "late_y": "m/s", "plant_y": "m"
    }  # fmt: skip
    assert block.interface.params["law_factor"].unit == "1/s"
    found = drive(block, rate="5 ms", steps=401)
    assert np.array_equal(found.plant_y, loop.run()["plant.y"])


@BOTH
def test_communication_steps_may_be_longer_or_shorter_than_ticks(
    version: int, whole: dict[int, Path], loop: Diagram
) -> None:
    ours = loop.run()["plant.y"]
    assert np.array_equal(by_fmpy(whole[version], 2.0, 0.05)["plant.y"], ours[::10])
    shorter = by_fmpy(whole[version], 2.0, 0.0025)["plant.y"]
    assert np.array_equal(shorter[::2], ours)
    assert np.array_equal(shorter[1::2], ours[:-1])


@BOTH
def test_parameters_have_their_effect(version: int, whole: dict[int, Path]) -> None:
    other = load_text(LOOP.replace("factor: 3 1/s", "factor: 5 1/s")).run()["plant.y"]
    found = by_fmpy(whole[version], 2.0, 0.005, start_values={"law.factor": 5.0})
    assert np.array_equal(found["plant.y"], other)
    block = Fmu(file=str(whole[version]), isolation="none", law_factor=5.0)
    assert np.array_equal(drive(block, rate="5 ms", steps=401).plant_y, other)


@pytest.mark.slow
@BOTH
def test_it_conforms_as_a_block(version: int, whole: dict[int, Path]) -> None:
    """Its state is saved, restored, and brought into another process."""
    given = {"file": str(whole[version]), "isolation": "none"}
    check_block(Fmu, given=given, test=Path(__file__))


def test_the_same_part_gives_the_same_bytes(loop: Diagram, whole: dict[int, Path], tmp_path: Path) -> None:
    loop.export_fmu(".", tmp_path / "again.fmu")
    assert (tmp_path / "again.fmu").read_bytes() == whole[2].read_bytes()


@pytest.mark.slow
@BOTH
def test_its_sources_make_the_same_library(version: int, whole: dict[int, Path], tmp_path: Path) -> None:
    """The files that the description names are compiled as an importer would, with all warnings."""
    with zipfile.ZipFile(whole[version]) as archive:
        archive.extractall(tmp_path)
    (library,) = tmp_path.glob("binaries/*/loop.so")
    files = ["steps.c", f"fmi{version}.c"]
    made = tmp_path / "made.so"
    warnings = ("-Wall", "-Wextra", "-Wno-unused-function", "-Wno-unused-label", "-Werror")
    subprocess.run(
        ["gcc", *OPTIONS, *warnings, *files, "-o", str(made), "-lm"], cwd=tmp_path / "sources", check=True
    )
    assert made.read_bytes() == library.read_bytes()


def with_part(folder: Path) -> Path:
    """Write a diagram with a part; return its path."""
    (folder / "law.yaml").write_text(LAW)
    lines = [
        "  law: {slot: true, part: law.yaml, rate: slow, in: {error: {from: error.y, across: sample}}}"
        if line.startswith("  law: ")
        else line.replace("u: law.y", "u: law.command")
        for line in LOOP.splitlines()
    ]
    text = "\n".join(lines)
    (folder / "loop.yaml").write_text(text)
    return folder / "loop.yaml"


@pytest.mark.parametrize("isolation", ["none", pytest.param("process", marks=pytest.mark.slow)])
def test_a_part_as_an_fmu_closes_its_loop_to_the_bit(isolation: str, tmp_path: Path) -> None:
    path = with_part(tmp_path)
    whole = quadvis.load(path)
    made = whole.export_fmu("law", tmp_path / "law.fmu")
    assert (made.inputs, made.outputs, made.step) == (("error",), ("command", "late"), 0.05)
    assert set(made.parameters) == {"scaled.factor"}
    (tmp_path / "other.yaml").write_text(
        f"""\
quadvis: 1
name: other
base: loop.yaml
blocks: {{law: {{block: fmi.fmu, rate: slow, with: {{file: law.fmu, isolation: {isolation}}}}}}}
"""
    )
    loaded = quadvis.load(tmp_path / "other.yaml")
    with pytest.raises(
        QuadvisError, match=r"'law' runs the machine code of 'law.fmu', which no target takes"
    ):
        pack(loaded)
    ours, other = whole.run(), loaded.run()
    for name in ("plant.y", "law.command", "law.late"):
        assert np.array_equal(ours[name], other[name]), name


GENERAL = """\
quadvis: 1
name: general
ports:
  in: [wave, ramp, at]
  out: {chosen: chosen.y, shaped: shaped.y, count: count.y, heat: heat.y, row: row.y}
blocks:
  error: {block: signal.sum, with: {signs: "+-+"}, in: {u: [in.wave, in.ramp, 20 cm]}}
  row: {block: signal.concatenate, in: {u: [in.wave, error.y, 1.5 m]}}
  largest: {block: math.min_max, with: {function: max}, in: {u: [in.wave, in.ramp, error.y]}}
  area: {block: math.product, in: {u: [largest.y, in.wave]}}
  size: {block: math.function, with: {function: abs}, in: {u: area.y}}
  side: {block: math.function, with: {function: sqrt}, in: {u: size.y}}
  rest: {block: math.modulo, in: {u: in.ramp, divisor: 30 cm}}
  picked: {block: signal.select, in: {index: [2, 0, 1], u: row.y}}
  high: {block: logic.compare, with: {operator: ">"}, in: {a: in.wave, b: rest.y}}
  low: {block: logic.compare, with: {operator: "<"}, in: {a: in.wave, b: side.y}}
  both: {block: logic.gate, with: {operator: xor}, in: {u: [high.y, low.y]}}
  count: {block: logic.counter, with: {upper: 3, at_limit: wrap}, in: {u: both.y}}
  chosen:
    block: logic.multiport_switch
    with: {outside: refuse}
    in: {index: in.at, u: ["picked.y[0]", side.y, rest.y, largest.y]}
  shaped:
    block: signal.lookup_1d
    with: {breakpoints: {value: [-1, 0, 2], unit: m}, values: {value: [0, 1, 4], unit: N}, outside: linear}
    in: {u: chosen.y}
  either: {block: logic.switch, in: {condition: both.y, then: error.y, otherwise: in.wave}}
  heat:
    block: signal.relay
    with: {on_at: 50 cm, off_at: 0 m, on_value: 2 W, off_value: 1 W}
    in: {u: either.y}
"""
FED = """\
quadvis: 1
name: fed
rates: {fast: 100 Hz}
stop_time: 1 s
params: {most: 3}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m, frequency: 2 Hz}}
  ramp: {block: sources.ramp, rate: fast, with: {slope: 2 m/s}}
  pulse: {block: sources.pulse, rate: fast, with: {interval: 0.2 s, width: 0.1 s, begin: 0.1 s}}
  up: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: pulse.y, b: 0.5}}
  at: {block: logic.counter, rate: fast, with: {upper: $most, at_limit: wrap}, in: {u: up.y}}
  part: {slot: true, part: general.yaml, rate: fast, in: {wave: wave.y, ramp: ramp.y, at: at.y}}
"""


@pytest.mark.slow
@BOTH
def test_blocks_of_the_general_library_do_the_same_together(version: int, tmp_path: Path) -> None:
    """Inputs of any number, whole numbers, truth values, tables; what a block refuses, it refuses in C."""
    (tmp_path / "general.yaml").write_text(GENERAL)
    (tmp_path / "fed.yaml").write_text(FED)
    (tmp_path / "other.yaml").write_text(
        "quadvis: 1\nname: other\nbase: fed.yaml\n"
        "blocks: {part: {block: fmi.fmu, rate: fast, with: {file: part.fmu, isolation: none}}}\n"
    )
    fed = quadvis.load(tmp_path / "fed.yaml")
    made = fed.export_fmu("part", tmp_path / "part.fmu", version=version)
    assert made.inputs == ("wave", "ramp", "at")
    ours, other = fed.run(), quadvis.load(tmp_path / "other.yaml").run()
    for name in made.outputs:
        assert np.array_equal(ours[f"part.{name}"], other[f"part.{name}"]), name
    one = fed.export_fmu("part/chosen", tmp_path / "one.fmu", version=version)
    assert one.inputs == ("index", "u_0", "u_1", "u_2", "u_3")
    words = "the index is no place of the list, which counts from 0"
    with pytest.raises(RunError, match=words):
        quadvis.load(tmp_path / "fed.yaml", settings={"most": "5"}).run()
    with pytest.raises(RunError, match=f"Error: block 'part/chosen', t = 0.7 s: {words}"):
        quadvis.load(tmp_path / "other.yaml", settings={"most": "5"}).run()


@pytest.mark.slow
@BOTH
def test_the_controller_of_hover_flies_as_an_fmu_to_the_bit(version: int, tmp_path: Path) -> None:
    hover = quadvis.load(HOVER, variant="geometric", stop_time="10 s")
    hover.export_fmu("control", tmp_path / "control.fmu", version=version)
    (tmp_path / "hover.yaml").write_text(
        f"""\
quadvis: 1
name: hover with an FMU
base: {{file: {HOVER}, variant: geometric}}
stop_time: 10 s
blocks: {{control: {{block: fmi.fmu, rate: control, with: {{file: control.fmu, isolation: none}}}}}}
analyse: {{}}
figures: []
expect: []
"""
    )
    ours, other = hover.run(), quadvis.load(tmp_path / "hover.yaml").run()
    for name in ("craft.position", "craft.attitude", "control.thrust"):
        assert np.array_equal(ours[name], other[name]), name


@pytest.mark.slow
def test_the_craft_of_hover_is_the_same_plant_in_fmpy_and_in_our_block(tmp_path: Path) -> None:
    """Thrusts are held over a step; our block alone is driven with the same."""
    hover = quadvis.load(HOVER, variant="geometric")
    hover.export_fmu("craft", tmp_path / "craft.fmu")
    craft = hover.graph["craft"].block
    given = {
        name: getattr(craft, name) for name, param in craft.interface.params.items() if not param.choices
    }
    rng = np.random.default_rng(1)
    thrust = 1.2 + 0.1 * rng.standard_normal((200, 4))
    ours = drive(type(craft)(**given), rate="5 ms", thrust=thrust)
    block = Fmu(file=str(tmp_path / "craft.fmu"), isolation="none")
    other = drive(block, rate="5 ms", thrust=thrust, wind=np.zeros((200, 3)))
    for name in ("position", "velocity", "attitude", "rates"):
        assert np.array_equal(getattr(ours, name), getattr(other, name)), name
    inputs = np.zeros(200, [("time", float), *((f"thrust[{k}]", float) for k in range(1, 5))])
    inputs["time"] = np.arange(200) * 0.005
    for k in range(4):
        inputs[f"thrust[{k + 1}]"] = thrust[:, k]
    del inputs  # fmpy interpolates inputs; the slave itself is driven
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(str(tmp_path / "craft.fmu"))
    references = {each.name: each.valueReference for each in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=extract(str(tmp_path / "craft.fmu"), str(tmp_path / "craft")),
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="craft",
    )  # fmt: skip
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for k, row in enumerate(thrust[:-1]):
        slave.setReal([references[f"thrust[{n}]"] for n in range(1, 5)], row.tolist())
        slave.doStep(k * 0.005, 0.005)
        found = slave.getReal([references[f"position[{n}]"] for n in range(1, 4)])
        assert np.array_equal(found, ours.position[k + 1])
    slave.terminate()
    slave.freeInstance()


@pytest.mark.parametrize(
    ("text", "name", "words"),
    [
        (LOOP, "lw", "there is no part and no block 'lw'; did you mean 'law'"),
        (LOOP + "tasking: multi\n", "law", "'tasking: multi' cannot be exported"),
        (
            LOOP + "  eyes: {block: vision.camera, rate: slow, with: {device: 'x.avi'}}\n",
            ".",
            r"only numeric blocks can be exported, and these are not: 'eyes' \(vision.camera\)",
        ),
    ],
)
def test_what_cannot_be_exported_is_refused(text: str, name: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(QuadvisError, match=words):
        load_text(text).export_fmu(name, tmp_path / "x.fmu")
    assert not list(tmp_path.iterdir())


def test_without_a_compiler_a_sentence_says_so(
    loop: Diagram, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(QuadvisError, match="an FMU is compiled by a C compiler, and there is none"):
        loop.export_fmu("law", tmp_path / "x.fmu")


@pytest.mark.slow
def test_an_output_out_of_the_finite_numbers_is_an_error_with_its_block(tmp_path: Path) -> None:
    text = LOOP.replace("factor: 3 1/s", "factor: 1e200 1/s")
    load_text(text).export_fmu("law", tmp_path / "law.fmu")
    with pytest.raises(RunError, match="block 'law', t = 0 s: port 'y': the output is not finite"):
        block = Fmu(file=str(tmp_path / "law.fmu"), isolation="none", direct="never")
        drive(block, rate="20 Hz", u=[1e200, 0.0, 0.0])
    with pytest.raises(ParameterError, match="factor"):
        Fmu(file=str(tmp_path / "law.fmu"), factor="x")


def test_the_command_says_what_it_has_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop.yaml").write_text(LOOP)
    assert main(["export", "loop.yaml", "--fmu", "law", "-o", "law.fmu"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "inputs:     u", "outputs:    y", "parameters: factor", "law.fmu: FMI 2.0, steps of 0.05 s"
    ]  # fmt: skip
    assert main(["export", "loop.yaml", "--fmu", "none"]) == 2
    assert "there is no part and no block 'none'" in capsys.readouterr().err
    (tmp_path / "text.fmu").write_text("not an FMU")
    assert main(["export", "loop.yaml", "--fmu", "law", "-o", "text.fmu"]) == 2
    assert shutil.which("gcc") and (tmp_path / "text.fmu").read_text() == "not an FMU"
