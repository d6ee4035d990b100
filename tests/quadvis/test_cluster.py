"""Sweeps on a cluster of Dask: the same table as on one machine, whatever happens to its workers."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.sweeps import cluster as clusters
from quadvis.sweeps import parcel as parcels
from quadvis.sweeps.parcel import Parcel, difference, moved_back, moved_job, software
from quadvis.sweeps.worker import Configuration, Job, Row
from tests.processes import children, linux

LOOP = """\
quadvis: 1
name: loop
base: base.yaml
stop_time: {time} s
"""
BASE = """\
quadvis: 1
name: base
rates: {fast: 20 Hz}
stop_time: 1 s
params: {size: 1 m}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $size, frequency: 1 Hz}}
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 cm}}
  law: {block: own.law, rate: fast, in: {u: wave.y}}
expect:
  - {signal: law.y, within: 150 cm}
summary:
  law: {signal: law.y, unit: cm}
  noise: {signal: noise.y, show: [rms, final], unit: mm}
"""
LAW = '''
from quadvis.block import Block, In, Out

from ._factor import FACTOR


class Law(Block):
    """Amplifies."""

    u = In(unit="m")
    y = Out(unit="m")

    def output(self, u):
        return FACTOR * u
'''
OVER = ["size='1 m','2 m'", "seed=0..9"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "law.py").write_text(LAW)
    (tmp_path / "blocks" / "own" / "_factor.py").write_text("FACTOR = 0.9\n")
    (tmp_path / "base.yaml").write_text(BASE)
    (tmp_path / "loop.yaml").write_text(LOOP.format(time=0.95))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def dask(stack: ExitStack, *words: str) -> subprocess.Popen[str]:
    """Start a program of Dask until the stack is closed."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler"][:2]
    process = stack.enter_context(
        subprocess.Popen([*command, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    )
    stack.callback(process.kill)
    return process


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """Return the address of a scheduler, and the programs of its two workers."""
    work = tmp_path_factory.mktemp("workers")
    with ExitStack() as stack:
        scheduler = dask(
            stack, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"
        )
        assert scheduler.stdout is not None
        address = next(line.split()[-1] for line in scheduler.stdout if "Scheduler at:" in line)
        threading.Thread(target=scheduler.stdout.read, daemon=True).start()
        workers = []
        for name in ("one", "two"):
            words = ("--nthreads", "1", "--no-dashboard", "--local-directory", str(work / name))
            nanny = dask(stack, "distributed.cli.dask_worker", address, *words)
            assert nanny.stdout is not None
            next(line for line in nanny.stdout if "Registered to:" in line)
            threading.Thread(target=nanny.stdout.read, daemon=True).start()
            workers.append(nanny)
        yield address, workers


@linux
@pytest.mark.slow
def test_the_table_is_the_same_as_on_one_machine_byte_for_byte(
    folder: Path, cluster: tuple[str, list[subprocess.Popen[str]]]
) -> None:
    address, _ = cluster
    quadvis.sweep("loop.yaml", OVER, workers=2, output="here.csv")
    quadvis.sweep("loop.yaml", OVER, cluster=address, output="there.csv")
    assert Path("there.csv").read_bytes() == Path("here.csv").read_bytes()
    pytest.importorskip("pyarrow")
    drawn = {"size": "normal(1.6 m, 20 cm)", "seed": "0..99"}
    for place, where in (("here", {"workers": 2}), ("there", {"cluster": address})):
        for name in (f"{place}-drawn.csv", f"{place}.parquet/"):
            quadvis.sweep(
                "loop.yaml", drawn, design="latin_hypercube", runs=100, until="failing within 14 %",
                output=name, **where,
            )  # fmt: skip
    assert Path("there-drawn.csv").read_bytes() == Path("here-drawn.csv").read_bytes()
    assert 40 < len(Path("here-drawn.csv").read_text().splitlines()) < 100
    part = "part-00000.parquet"
    assert Path("there.parquet", part).read_bytes() == Path("here.parquet", part).read_bytes()
    Path("blocks/own/_factor.py").write_text("FACTOR = 0.8\n")  # another parcel of the same names
    table = quadvis.sweep("loop.yaml", OVER, cluster=address)
    expected = pytest.approx(0.8 / 0.9 * _first("here.csv"), rel=1e-9)
    assert not any(table["failure"])
    assert table["law.rms [cm]"][0] == expected


def _first(name: str) -> float:
    head, first, *_ = Path(name).read_text().splitlines()
    return float(first.split(",")[head.split(",").index("law.rms [cm]")])


@linux
@pytest.mark.slow
def test_a_worker_that_is_killed_costs_no_row(
    folder: Path, cluster: tuple[str, list[subprocess.Popen[str]]]
) -> None:
    (folder / "loop.yaml").write_text(LOOP.format(time=20))
    address, (_, nanny) = cluster
    killed: list[int] = []

    def kill(finished: int, count: int, failed: int) -> None:
        if finished > 10 and not killed:
            killed.extend(children(nanny))
            for process in killed:
                os.kill(process, signal.SIGKILL)

    over = ["size='1 m','2 m'", "seed=0..29"]
    quadvis.sweep("loop.yaml", over, cluster=address, output="there.csv", progress=kill)
    quadvis.sweep("loop.yaml", over, workers=1, output="here.csv")
    assert killed and Path("there.csv").read_bytes() == Path("here.csv").read_bytes()


@linux
@pytest.mark.slow
def test_a_command_is_resumed_and_a_failure_names_what_is_here(
    folder: Path, cluster: tuple[str, list[subprocess.Popen[str]]], capsys: pytest.CaptureFixture[str]
) -> None:
    address, _ = cluster
    failing = LAW.replace("return FACTOR * u", 'raise ValueError("no more")')
    (folder / "blocks" / "own" / "law.py").write_text(failing)
    arguments = ["loop.yaml", "--over", "seed=0..3", "--cluster", address, "--plot", "", "-o", "table.csv"]
    assert main(["sweep", *arguments]) == 1
    shown = capsys.readouterr().out
    assert "stopped: seed=0 (and 3 more)" in shown and "quadvis-" not in shown
    (folder / "blocks" / "own" / "law.py").write_text(LAW)
    assert main(["sweep", *arguments, "--resume"]) == 0
    assert "PASSED: 4 of 4 runs passed" in capsys.readouterr().out


def test_who_does_not_answer_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "PATIENCE", 0.3)
    with pytest.raises(QuadvisError, match=re.escape("at 'tcp://127.0.0.1:9'; start 'dask scheduler'")):
        quadvis.sweep("loop.yaml", OVER, cluster="tcp://127.0.0.1:9")
    with pytest.raises(QuadvisError, match="no scheduler of Dask answers at 'nowhere'"):
        quadvis.sweep("loop.yaml", OVER, cluster="nowhere")


def test_a_cluster_has_its_own_workers_and_writes_no_logs(folder: Path) -> None:
    with pytest.raises(QuadvisError, match="workers and cluster exclude each other"):
        quadvis.sweep("loop.yaml", OVER, cluster="tcp://host:1", workers=2)
    with pytest.raises(QuadvisError, match="leave logs out"):
        quadvis.sweep("loop.yaml", OVER, cluster="tcp://host:1", logs="logs")


def test_a_parcel_has_the_files_and_no_code_of_quadvis(folder: Path, tmp_path: Path) -> None:
    diagram = quadvis.load("loop.yaml")
    found = Parcel.of(diagram.inputs)
    names = {str(Path(name).relative_to(folder)) for name in found.files}
    assert names == {"loop.yaml", "base.yaml", "blocks/own/law.py", "blocks/own/_factor.py"}
    assert found.key == Parcel.of([*diagram.inputs, folder / "missing"]).key
    there = tmp_path / "there"
    found.unpack(there)
    job = moved_job(Job(0, Configuration(str(folder / "loop.yaml")), files=diagram.files), there)
    assert job.configuration.load().hash == diagram.hash
    row = Row(0, failure=f"{there}{folder}/loop.yaml:1: no")
    assert moved_back(row, there).failure == f"{folder}/loop.yaml:1: no"


def test_other_software_is_refused_with_what_differs(monkeypatch: pytest.MonkeyPatch) -> None:
    theirs = dict(software())
    assert difference(theirs) == ""
    assert "has another numpy: 1.0, here it is " in difference(theirs | {"numpy": "1.0"})
    assert "has another quadvis: code 0" in difference(theirs | {"quadvis": "code 0"})
    assert set(parcels.DECISIVE) < set(theirs)
