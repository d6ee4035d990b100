"""Designs of sweeps: drawn as scipy and SALib draw them, estimated, ended early, resumed, in parts."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.sweeps import parts, saving
from quadvis.sweeps import sweep as sweeping
from quadvis.sweeps.axes import read_axes
from quadvis.sweeps.designs import make_design
from quadvis.sweeps.estimates import estimate_mean, estimate_probability, estimate_quantile
from quadvis.sweeps.sensitivity import sensitivities
from quadvis.sweeps.steps import Steps
from quadvis.sweeps.table import read_rows
from quadvis.sweeps.worker import Job, Row, perform, quantities

PI = "3.141592653589793"
# Ishigami and Homma's function of three angles, with a = 7 and b = 0.1.
ISHIGAMI = """\
quadvis: 1
name: ishigami
rates: {fast: 20 Hz}
stop_time: 0.1 s
params: {a: 1, b: 1, c: 1}
blocks:
  a: {block: sources.constant, rate: fast, with: {value: $a}}
  b: {block: sources.constant, rate: fast, with: {value: $b}}
  c: {block: sources.constant, rate: fast, with: {value: $c}}
  f:
    block: math.expression
    rate: fast
    with: {y: "sin(p * 1 rad) + 7 * sin(q * 1 rad)^2 + 0.1 * r^4 * sin(p * 1 rad)"}
    in: {p: a.y, q: b.y, r: c.y}
expect:
  - {signal: f.y, below: 9}
summary:
  f: {signal: f.y, show: [final]}
"""
MASS = """\
quadvis: 1
name: mass
rates: {fast: 20 Hz}
stop_time: 0.1 s
params: {mass: 0.5 kg, count: 1}
blocks:
  mass: {block: sources.constant, rate: fast, with: {value: $mass}}
  count: {block: sources.constant, rate: fast, with: {value: $count}}
expect:
  - {signal: mass.y, below: 500 g}
summary:
  mass: {signal: mass.y, show: [final], unit: g}
"""
NORMAL = "mass=normal(0.5 kg, 20 g)"


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mass.yaml").write_text(MASS)
    (tmp_path / "ishigami.yaml").write_text(ISHIGAMI)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Do the runs in this process; return which were done."""
    done: list[int] = []

    def in_turn(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        for job in jobs:
            done.append(job.index)
            yield perform(job)

    monkeypatch.setattr(sweeping, "perform_all", in_turn)
    return done


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Make up the rows of mass.yaml from the settings, since a real run takes some ms; return which."""
    done: list[int] = []

    def made(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        for job in jobs:
            done.append(job.index)
            text = next((text for text in job.configuration.settings if text.startswith("mass=")), "mass=0.5")
            mass = 1000 * float(text.removeprefix("mass=").split()[0])
            yield Row(job.index, f"{job.index:08}", ("g", "g"), (mass, mass), mass < 500.0)

    monkeypatch.setattr(sweeping, "perform_all", made)
    return done


def rows_of(path: str) -> list[dict[str, str]]:
    with Path(path).open(newline="") as file:
        return list(csv.DictReader(file))


# what is drawn


def places(name: str, *over: str, runs: int | None = None, seed: int = 3) -> np.ndarray:
    design = make_design(read_axes(list(over), name), name, runs, seed)
    return design.places(range(design.runs))


def test_a_latin_hypercube_and_a_sobol_sequence_are_those_of_scipy() -> None:
    over = ("a=1..4 rad/s", "b=normal(2, 0.5)", "c=loguniform(1 mm, 1 m)")
    laws = (stats.uniform(1, 3), stats.norm(2, 0.5), stats.loguniform(1, 1000))
    for name, kind in (("latin_hypercube", qmc.LatinHypercube), ("sobol", qmc.Sobol)):
        shares = kind(3, rng=np.random.default_rng(3)).random(64)
        wanted = np.stack([law.ppf(shares[:, number]) for number, law in enumerate(laws)], axis=1)
        np.testing.assert_allclose(places(name, *over, runs=64), wanted, rtol=1e-12)
    assert (places("sobol", *over, runs=64) != places("sobol", *over, runs=64, seed=4)).all()


@pytest.mark.parametrize(
    ("text", "law", "unit"),
    [
        ("uniform(1, 4 rad/s)", stats.uniform(1, 3), "rad/s"),
        ("normal(0.5 kg, 20 g)", stats.norm(0.5, 0.02), "kg"),
        ("truncated_normal(0, 1, -1, 2 m)", stats.truncnorm(-1, 2), "m"),
        ("lognormal(2 s, 1.5)", stats.lognorm(math.log(1.5), scale=2), "s"),
        ("loguniform(10 g, 1 kg)", stats.loguniform(10, 1000), "g"),
        ("triangular(1, 2, 5)", stats.triang(0.25, 1, 4), ""),
    ],
)
def test_distributions_are_those_of_scipy_in_the_unit_written_first(
    text: str, law: stats.rv_continuous, unit: str
) -> None:
    axis = read_axes([f"x={text}"], "random")[0]
    shares = np.random.default_rng(7).random((2000, 1))
    np.testing.assert_allclose(places("random", f"x={text}", runs=2000, seed=7)[:, 0], law.ppf(shares[:, 0]))
    assert axis.unit == unit
    assert axis.text(0.1) == f"0.1 {unit}".rstrip()
    assert stats.kstest(places("random", f"x={text}", runs=2000, seed=7)[:, 0], law.cdf).pvalue > 0.01


@given(st.floats(allow_nan=False, allow_infinity=False, width=64))
def test_a_drawn_value_is_set_to_the_bit(value: float) -> None:
    text = read_axes(["x=0..1 m"], "sobol")[0].text(value)
    assert float(text.removesuffix(" m")) == value


def test_listed_values_are_drawn_alike_often_and_each_seed_once() -> None:
    drawn = places("latin_hypercube", "seed=0..49", "variant=none,half", "x=1..2 step 0.5", runs=50)
    assert sorted(drawn[:, 0]) == list(range(50))
    assert np.bincount(drawn[:, 1].astype(int)).tolist() == [25, 25]
    assert set(np.bincount(drawn[:, 2].astype(int))) <= {16, 17, 18}


@pytest.mark.parametrize("name", ["random", "sobol", "saltelli"])
def test_more_runs_begin_with_the_same_ones(name: str) -> None:
    few, many = (places(name, "a=0..1.5", "b=0..2.5", runs=runs) for runs in (64, 256))
    np.testing.assert_array_equal(many[: len(few)], few)
    assert len(few) == 64 and len(many) == 256


def test_one_at_a_time_has_the_diagrams_own_values_first() -> None:
    drawn = places("one_at_a_time", "a=0..4 m", "b=5,7", "c=normal(0, 1)")
    own, tail = math.nan, stats.norm.ppf(0.95)
    wanted = [
        [own, own, own], [0, own, own], [4, own, own], [own, 0, own], [own, 1, own],
        [own, own, -tail], [own, own, tail],
    ]  # fmt: skip
    np.testing.assert_allclose(drawn, wanted)
    assert len(places("one_at_a_time", "a=0..4 m", "b=5,7", runs=12)) == 12


def test_a_million_seeds_take_no_memory_and_are_exact() -> None:
    axis = read_axes(["seed=0..999999"])[0]
    assert isinstance(axis.values, Steps)
    assert len(axis.values) == 1_000_000
    assert axis.cells([0, 999_999]).tolist() == [0, 999_999]
    assert axis.values[-1] == "999999"


BAD = [
    ("--design", "lattice"),
    ("--design", "random"),
    ("--design", "random", "--runs", "0"),
    ("--design", "random", "--runs", "1000001"),
    ("--runs", "20"),
    ("--design", "saltelli", "--runs", "5"),
    ("--design", "random", "--runs", "9", "--until", "failing"),
    ("--design", "random", "--runs", "9", "--until", "mas.final within 1 g"),
    ("--design", "random", "--runs", "9", "--until", "mass.final within 1 m"),
    ("--design", "random", "--runs", "9", "--until", "failing within 1 g"),
    ("--design", "random", "--runs", "9", "--until", "failing within 0 %"),
    ("--design", "one_at_a_time", "--until", "failing within 2 %"),
    ("--design", "one_at_a_time", "--runs", "2"),
    ("--design", "one_at_a_time", "--sensitivity", "s.png"),
    ("--design", "random", "--runs", "9", "--sensitivity", "s.png"),
    ("--design", "random", "--runs", "99", "--sensitivity", "s.pdf"),
    ("--design", "random", "--runs", "9", "--quantiles", "5,150"),
    ("--design", "random", "--runs", "9", "--over", "count=normal(1)"),
    ("--design", "random", "--runs", "9", "--over", "count=normal(1, 0)"),
    ("--design", "random", "--runs", "9", "--over", "count=normal(1, 2 m, 3)"),
    ("--design", "random", "--runs", "9", "--over", "count=normal(1 m, 2 s)"),
    ("--design", "random", "--runs", "9", "--over", "count=4..1.5"),
    ("--design", "random", "--runs", "9", "--over", "count=1..x"),
    ("--design", "random", "--runs", "9", "--over", "seed=uniform(1, 2)"),
    ("--design", "random", "--runs", "9", "--over", "count=1 m..2 s"),
]


@pytest.mark.parametrize("arguments", BAD, ids=" ".join)
def test_what_is_no_design_is_reported_in_one_sentence(
    arguments: tuple[str, ...], quick: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    over = "mass=normal(0.5 kg, 20 g)" if "--design" in arguments else "mass=1 kg,2 kg"
    assert main(["sweep", "mass.yaml", "--over", over, *arguments, "-o", "x.csv"]) == 2
    reported = capsys.readouterr().err
    assert reported.count("\n") == 1 and len(reported) < 240
    assert quick == []
    assert not Path("x.csv").exists()


def test_a_grid_has_no_distributions_and_says_what_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "mass.yaml", "--over", NORMAL]) == 2
    assert "--design latin_hypercube" in capsys.readouterr().err


# what is run, and what it says


def test_the_runs_have_the_values_of_their_rows_to_the_bit(here: list[int]) -> None:
    over = {"mass": "normal(0.5 kg, 20 g)", "seed": "0..19"}
    table = quadvis.sweep("mass.yaml", over, design="latin_hypercube", runs=20, seed=5, output="x.csv")
    shares = qmc.LatinHypercube(2, rng=np.random.default_rng(5)).random(20)
    np.testing.assert_array_equal(table["mass [kg]"], stats.norm(0.5, 0.02).ppf(shares[:, 0]))
    np.testing.assert_array_equal(table["mass.y always below 500 g [g]"], table["mass.final [g]"])
    np.testing.assert_allclose(table["mass.final [g]"], 1000 * table["mass [kg]"])
    assert sorted(table["seed"]) == list(range(20))
    assert [float(row["mass [kg]"]) for row in rows_of("x.csv")] == table["mass [kg]"].tolist()
    assert table["passed"].tolist() == (table["mass [kg]"] < 0.5).tolist()


def test_one_at_a_time_runs_the_diagram_as_it_is_and_each_change(
    here: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    over = ["--over", "mass=400 g,600 g", "--over", "count=1..2"]
    assert main(["sweep", "mass.yaml", *over, "--design", "one_at_a_time", "-o", "x.csv"]) == 1
    found = [(row["mass [g]"], row["count"], float(row["mass.final [g]"])) for row in rows_of("x.csv")]
    assert found == [
        ("", "", 500), ("400.0", "", 400), ("600.0", "", 600), ("", "1.0", 500), ("", "2.0", 500),
    ]  # fmt: skip
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split() == ["mass=400", "g", "yes", "400"] for line in lines)
    assert Path("x.png").read_bytes().startswith(b"\x89PNG")


def ishigami(a: float, b: float, c: float) -> float:
    return math.sin(a) + 7 * math.sin(b) ** 2 + 0.1 * c**4 * math.sin(a)


def indices() -> tuple[np.ndarray, np.ndarray]:
    """Return the first-order and total indices of that function, in closed form (Saltelli et al. 2008)."""
    a, b = 7.0, 0.1
    variance = a**2 / 8 + b * math.pi**4 / 5 + b**2 * math.pi**8 / 18 + 0.5
    first = np.array([0.5 * (1 + b * math.pi**4 / 5) ** 2, a**2 / 8, 0.0]) / variance
    both = b**2 * math.pi**8 * (1 / 18 - 1 / 50) / variance
    return first, first + np.array([both, 0.0, both])


ANGLES = {name: f"-{PI}..{PI}" for name in "abc"}


def test_the_indices_of_sobol_are_those_of_ishigamis_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    def made(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        for job in jobs:
            value = ishigami(*(float(text.partition("=")[2]) for text in job.configuration.settings))
            yield Row(job.index, "", ("", ""), (value, value), value < 9.0)

    monkeypatch.setattr(sweeping, "perform_all", made)
    table = quadvis.sweep("ishigami.yaml", ANGLES, design="saltelli", runs=12_000, sensitivity="s.png")
    assert table.runs == 10_240  # 2048 x (3 + 2)
    (found,) = sensitivities(table)
    first, total = indices()
    assert found.total is not None and found.total_width is not None
    np.testing.assert_allclose(found.first, first, atol=0.02)
    np.testing.assert_allclose(found.total, total, atol=0.02)
    assert (np.abs(found.total - total) < 2 * found.total_width).all()
    assert Path("s.png").read_bytes().startswith(b"\x89PNG")
    (found,) = sensitivities(quadvis.sweep("ishigami.yaml", ANGLES, design="sobol", runs=4096))
    np.testing.assert_allclose(found.first, first, atol=0.03)
    assert found.total is None


@pytest.mark.slow
def test_the_indices_of_sobol_are_found_through_a_diagram(here: list[int]) -> None:
    table = quadvis.sweep("ishigami.yaml", ANGLES, design="saltelli", runs=1280)
    values = [ishigami(*places) for places in table.design.places(range(table.runs))]
    np.testing.assert_allclose(table["f.final"], values, rtol=1e-12)
    (found,) = sensitivities(table)
    first, total = indices()
    np.testing.assert_allclose(found.first, first, atol=0.13)  # so few runs know no more
    assert found.total is not None
    np.testing.assert_allclose(found.total, total, atol=0.02)


@pytest.mark.slow
def test_runs_that_stopped_are_left_out_with_their_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def made(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        for job in jobs:
            value = ishigami(*(float(text.partition("=")[2]) for text in job.configuration.settings))
            stopped = Row(job.index, failure="it stopped")
            yield Row(job.index, "", ("", ""), (value, value), True) if job.index % 97 else stopped

    monkeypatch.setattr(sweeping, "perform_all", made)
    (found,) = sensitivities(quadvis.sweep("ishigami.yaml", ANGLES, design="saltelli", runs=10_240))
    assert found.runs == 10_240 - 5 * 106
    np.testing.assert_allclose(found.first, indices()[0], atol=0.05)


# estimates


@pytest.mark.parametrize(
    ("count", "runs", "low", "high"),
    [
        (0, 10, 0.0, 0.277533),  # as the closed form gives them
        (1, 10, 0.017876, 0.404150),
        (15, 148, 0.0624, 0.1605),  # Newcombe (1998), table I: 15 of 148
        (81, 263, 0.2553, 0.3662),  # the same: 81 of 263
        (29, 29, 0.883030, 1.0),
    ],
)
def test_the_interval_of_a_probability_is_wilsons(count: int, runs: int, low: float, high: float) -> None:
    found = estimate_probability(count, runs)
    assert found == pytest.approx((count / runs, low, high), abs=6e-5)
    z, share = stats.norm.ppf(0.975), count / runs
    middle = (share + z**2 / (2 * runs)) / (1 + z**2 / runs)
    half = z / (1 + z**2 / runs) * math.sqrt(share * (1 - share) / runs + z**2 / (4 * runs**2))
    assert (found.low, found.high) == pytest.approx((middle - half, middle + half), abs=1e-12)


def test_intervals_hold_what_they_are_of_in_19_of_20_samples() -> None:
    rng = np.random.default_rng(1)
    means = quantiles = 0
    for _ in range(200):
        values = rng.normal(3.0, 1.0, 40)
        mean, median = estimate_mean(values), estimate_quantile(values, 50.0)
        means += mean.low <= 3.0 <= mean.high
        quantiles += median.low <= 3.0 <= median.high
    assert 180 <= means <= 199
    assert 180 <= quantiles <= 200
    many = rng.exponential(1.0, 2001)
    few = stats.bootstrap((many,), np.mean, rng=np.random.default_rng(2), n_resamples=999).confidence_interval
    assert estimate_mean(many)[1:] == pytest.approx((few.low, few.high), abs=0.01)


def test_the_summary_has_intervals_quantiles_and_probabilities(
    quick: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--design", "random", "--runs", "400", "--quantiles", "10,90", "--plot", ""]
    assert main(["sweep", "mass.yaml", "--over", NORMAL, *options]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "mass: 400 runs, random over mass"
    values = np.array([float(row["mass.final [g]"]) for row in rows_of("runs/mass-sweep.csv")])
    shares = [f"{share:.4g}" for share in np.percentile(values, [10, 90])]
    line = next(line for line in lines if line.startswith("  mass.final [g]"))
    assert line.split()[2] == f"{values.mean():.4g}" and line.split()[-2:] == shares
    failed = int((values >= 500).sum())
    probability = estimate_probability(failed, 400)
    line = next(line for line in lines if line.startswith("  mass.y always below 500 g"))
    assert f"{failed} of 400" in line
    assert f"{100 * probability.low:.4g} to {100 * probability.high:.4g} %" in line


# ending early, and resuming


def test_a_sweep_ends_when_it_knows_enough_whatever_the_order(
    quick: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--design", "random", "--runs", "5000", "--until", "failing within 5 %", "--plot", ""]
    assert main(["sweep", "mass.yaml", "--over", NORMAL, *options, "-o", "x.csv"]) == 1
    shown = capsys.readouterr().out
    count = len(rows_of("x.csv"))
    failed = sum(row["passed"] == "false" for row in rows_of("x.csv"))
    found = estimate_probability(failed, count)
    half = (found.high - found.low) / 2
    assert 0.045 < half <= 0.05
    assert f"stopped after {count} of 5000 runs: failing is known within {100 * half:.2g} %" in shown
    assert 340 < count < 430  # 0.25 (1.96 / 0.05)^2 = 384, and looks are 10 % apart
    whole = quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=5000)
    assert whole["mass [kg]"][:count].tolist() == [float(row["mass [kg]"]) for row in rows_of("x.csv")]


def test_a_sweep_ends_by_the_mean_of_a_number_and_by_seeds_alone(quick: list[int]) -> None:
    table = quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=5000, until="mass.final within 2 g")
    assert 350 < table.runs < 460  # (1.96 x 20 g / 2 g)^2 = 384
    table = quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=5000, until="mass.final within 1 %")
    assert 60 < table.runs < 90  # (1.96 x 20 g / 5 g)^2 = 61
    table = quadvis.sweep("mass.yaml", ["seed=0..999"], until="failing within 6 %")
    assert table.runs < 100
    table = quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=60, until="failing within 1 %")
    assert table.runs == 60 and table.note.startswith(
        "after all 60 runs failing is known within 12 %, not 1 %"
    )


def test_rows_that_came_too_early_are_left_out(monkeypatch: pytest.MonkeyPatch, quick: list[int]) -> None:
    made = sweeping.perform_all

    def shuffled(jobs: Iterator[Job], workers: int) -> Iterator[Row | None]:
        rows = list(made(jobs, workers))
        for first in range(0, len(rows), 40):
            yield from reversed(rows[first : first + 40])

    expected = quadvis.sweep("mass.yaml", [NORMAL], design="sobol", runs=2000, until="failing within 5 %")
    monkeypatch.setattr(sweeping, "perform_all", shuffled)
    found = quadvis.sweep("mass.yaml", [NORMAL], design="sobol", runs=2000, until="failing within 5 %")
    assert {name: found[name].tolist() for name in found} == {
        name: expected[name].tolist() for name in expected
    }


def test_a_resumed_design_goes_on_with_the_same_runs(here: list[int]) -> None:
    for name in ("latin_hypercube", "sobol", "random"):
        quadvis.sweep("mass.yaml", [NORMAL], design=name, runs=8, output="whole.csv")
        lines = Path("whole.csv").read_text().splitlines(keepends=True)
        Path("x.csv").write_text("".join([lines[0], lines[5], lines[2]]))
        here.clear()
        quadvis.sweep("mass.yaml", [NORMAL], design=name, runs=8, output="x.csv", resume=True)
        assert here == [0, 2, 3, 5, 6, 7]
        assert Path("x.csv").read_bytes() == Path("whole.csv").read_bytes()
    here.clear()
    quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=10, output="x.csv", resume=True)
    assert here == [8, 9]


# parts


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(parts, "PART", 100)


def test_a_folder_of_parts_has_the_rows_of_one_file(quick: list[int], small_parts: None) -> None:
    pandas = pytest.importorskip("pandas")
    over = [NORMAL, "seed=0..249"]
    one = quadvis.sweep("mass.yaml", over, design="sobol", runs=250, output="one.parquet")
    many = quadvis.sweep("mass.yaml", over, design="sobol", runs=250, output="many.parquet/", plot="m.png")
    assert sorted(path.name for path in Path("many.parquet").iterdir()) == [
        f"part-0000{number}.parquet" for number in range(3)
    ]
    assert list(many) == list(one)
    for name in one:
        assert many[name].tolist() == one[name].tolist()
    assert pandas.read_parquet("many.parquet").equals(pandas.read_parquet("one.parquet"))
    assert many.reasons() == one.reasons() == {}
    assert [rows.tolist() for _, rows in many.groups()] == [list(range(250))]


def test_parts_are_resumed_where_they_ended_with_the_same_bytes(quick: list[int], small_parts: None) -> None:
    def broken(jobs: Iterator[Job], workers: int) -> Iterator[Row | None]:
        for number, row in enumerate(made(jobs, workers)):
            if number == 230:
                raise KeyboardInterrupt
            if number != 140:  # a run that lasts
                yield row

    def bytes_of(folder: str) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}

    made, monkeypatch = sweeping.perform_all, pytest.MonkeyPatch()
    quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=350, output="whole.parquet/")
    with monkeypatch.context() as patch:
        patch.setattr(sweeping, "perform_all", broken)
        with pytest.raises(KeyboardInterrupt):
            quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=350, output="x.parquet/")
    assert set(bytes_of("x.parquet")) == {"part-00000.parquet", parts.UNFINISHED}
    quick.clear()
    arguments = ["--over", NORMAL, "--design", "random", "--plot", "", "-o", "x.parquet", "--resume"]
    assert main(["sweep", "mass.yaml", *arguments, "--runs", "350"]) == 1
    assert quick == [140, *range(230, 350)]
    assert bytes_of("x.parquet") == bytes_of("whole.parquet")
    with pytest.raises(QuadvisError, match="another diagram, design or seed; leave resume out"):
        quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=9, seed=1, output="x.parquet", resume=True)
    assert bytes_of("x.parquet") == bytes_of("whole.parquet")
    quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=9, output="x.parquet")
    assert set(bytes_of("x.parquet")) == {"part-00000.parquet"}


def test_rows_before_their_part_is_complete_are_written_now_and_then(
    quick: list[int], small_parts: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(saving, "SAVE", 0.0)
    monkeypatch.setattr(saving, "SHARE", 0)
    kept: list[int] = []

    def look(finished: int, count: int, failed: int) -> None:
        path = Path("x.parquet") / parts.UNFINISHED
        kept.append(len(read_rows(path)) if path.stat().st_size else 0)

    quadvis.sweep("mass.yaml", [NORMAL], design="random", runs=120, output="x.parquet/", progress=look)
    assert kept == [*range(100), *range(20)]


def test_a_large_table_is_a_folder_and_nothing_else(
    quick: list[int], small_parts: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sweeping, "MOST_IN_FILE", 150)
    arguments = ["mass.yaml", "--over", NORMAL, "--design", "random", "--runs", "151", "--plot", "", "-o"]
    assert main(["sweep", *arguments, "x.csv"]) == 2
    assert "a name that ends in .parquet" in capsys.readouterr().err
    Path("y.parquet").mkdir()
    Path("y.parquet/notes.txt").write_text("mine")
    assert main(["sweep", *arguments, "y.parquet"]) == 2
    assert "other files, such as 'notes.txt'" in capsys.readouterr().err
    assert quick == []
    assert main(["sweep", *arguments, "x.parquet", "--until", "failing within 9 %"]) == 1
    assert 100 < len(quick) <= 151
    shown = capsys.readouterr().out
    count = int(shown.partition("stopped after ")[2].split()[0])
    assert [path.name for path in sorted(Path("x.parquet").iterdir())] == [
        "part-00000.parquet", "part-00001.parquet",
    ]  # fmt: skip
    parquet = pytest.importorskip("pyarrow.parquet")
    assert parquet.read_table("x.parquet").num_rows == count


def test_each_expectation_is_judged_by_its_number_as_in_the_run(here: list[int]) -> None:
    table = quadvis.sweep("mass.yaml", ["mass=499 g,500 g,501 g"])
    judge = quantities(quadvis.load("mass.yaml"))[-1]
    assert [judge.holds(value) for value in table[judge.column]] == table["passed"].tolist()
    assert not judge.holds(math.nan)
