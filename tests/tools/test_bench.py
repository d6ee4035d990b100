"""The program that measures: each table has the rows that it promises, and only right values are timed."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.errors import QuadvisError
from quadvis.library.catalogue import Catalogue
from tests.diagrams import golden

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench"
bench = loaded(TOOL)  # now its package is found

from benchmarks import choices, commands, flights, peers, tasks, whole_library  # noqa: E402
from benchmarks.programs import python_by_hand  # noqa: E402
from benchmarks.tasks import Task  # noqa: E402

NAMES = ["a", "b", "c100"]
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="C by hand needs gcc")


def rows(*arguments: str) -> dict[str, list[dict[str, Any]]]:
    done = run_script(TOOL, *arguments, "--rounds", "1", "--budget", "1", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    found: dict[str, list[dict[str, Any]]] = json.loads(done.stdout)
    return found


def measured(programs: str, names: str = "a,b,c100") -> list[dict[str, Any]]:
    return rows("peers", "--tasks", names, "--programs", programs)["peers"]


# The tasks


def test_task_b_has_thirty_blocks_and_task_c_as_many_as_it_says() -> None:
    assert len(tasks.thirty()) == 30
    assert len(tasks.chain(100)) == 101  # the constant before the chain


@pytest.mark.parametrize("name", [*NAMES, "c4"])
def test_the_loops_by_hand_give_what_is_expected(name: str) -> None:
    task = Task.named(name)
    values = python_by_hand.build(task)(task.check)()
    assert list(values) == pytest.approx(task.expected(task.check), abs=1e-13)


@pytest.mark.parametrize(("steps", "expected"), [(1, [0.999, 0.0]), (2, [0.999**2]), (9, [0.999**2])])
def test_each_delay_of_the_chain_delays_by_one_sample(steps: int, expected: list[float]) -> None:
    assert Task("c", 4).expected(steps) == expected


def test_the_loop_is_in_full_motion_where_it_is_compared() -> None:
    assert max(map(abs, Task("a").expected(5000)[6:])) > 0.1
    assert Task("a").expected(5000) != pytest.approx(Task("b").expected(5000), abs=1e-4)


# The programs


@pytest.mark.slow
def test_interpreted_blocks_do_the_tasks_right_and_are_timed() -> None:
    found = measured("quadvis_python,python_by_hand")
    assert [row["task"] for row in found] == [name for name in NAMES for _ in range(2)]
    for row in found:
        assert row["note"] == "" and row["error"] < 1e-12
        assert row["step"] > 0.0 and row["load"] >= 0.0 and row["build"] >= 0.0
        blocks = Task.named(row["task"]).blocks
        assert row["block"] == (pytest.approx(row["step"] / blocks) if blocks else None)


@pytest.mark.slow
@needs_gcc
def test_ratios_are_those_to_c_by_hand() -> None:
    found = measured("python_by_hand,c")
    assert [row["program"] for row in found] == ["C by hand", "Python by hand"] * 3
    for c, python in zip(found[::2], found[1::2], strict=True):
        assert c["ratio"] == 1.0 and c["error"] < 1e-12
        assert python["ratio"] == pytest.approx(python["step"] / c["step"])
        assert python["ratio"] > 2.0


@pytest.mark.slow
def test_machine_code_does_the_tasks_right_and_a_cold_start_is_longer() -> None:
    found = measured("quadvis_native,numba_by_hand")
    assert [row["note"] for row in found] == [""] * 6
    assert all(
        row["cold"] > row["build"] for row in found if row["program"] == peers.PROGRAMS["quadvis_native"]
    )


def test_without_gcc_there_is_a_line_and_no_ratio(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    c, python = measured("c,python_by_hand", "c100")
    assert c["note"] == "not installed: gcc is not installed"
    assert python["step"] > 0.0 and python["ratio"] is None


@pytest.mark.skipif(find_spec("bdsim") is not None, reason="bdsim is installed")
def test_a_program_that_is_not_installed_is_left_out_with_one_line() -> None:
    done = run_script(TOOL, "peers", "--tasks", "c100", "--programs", "bdsim")
    assert done.stdout == "c100    bdsim: not installed: No module named 'bdsim'\n"


def test_wrong_values_are_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Task, "expected", lambda self, steps: [0.5, 0.0])
    (row,) = measured("python_by_hand", "c100")
    assert row["note"] == f"its values are wrong by {0.999**20 - 0.5:.1e}"
    assert row["step"] is None


def test_a_program_that_ends_is_reported() -> None:
    worker = peers.Worker("nothing", Task("b"), sys.executable)
    with worker, pytest.raises(peers.WorkerError, match="it ended with exit code 1"):
        worker.answer()


def test_too_many_blocks_for_a_program_are_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(python_by_hand, "MOST", 50, raising=False)
    (row,) = measured("python_by_hand", "c100")
    assert row["note"] == "not tried with more than 50 blocks"


# The other tables


def test_flights_have_a_row_each_and_the_parts_of_the_interpreted_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        flights, "FLIGHTS", [("geometric", "python", True, ""), ("geometric", "python", False, "")]
    )
    first, *parts, last, second = flights.flights(1, stop_time="0.5 s")
    assert [row.unit for row in (first, second)] == ["x real time"] * 2
    assert len(parts) == flights.SHARES and last.what == "  judging and log"
    assert sum(row.value for row in parts) + last.value < 100.1


def test_the_time_of_a_run_is_shared_out_among_its_blocks_and_the_engine() -> None:
    diagram = quadvis.load(flights.HOVER, variant="geometric", stop_time="0.5 s")
    spent = flights.shares(diagram)
    engine = spent.pop("engine: order, solver, checks")
    assert {node.path for node in diagram.graph.nodes} >= spent.keys() >= {"craft", "imu", "eyes/camera"}
    assert engine > 0.0 and min(spent.values()) > 0.0


def test_loading_is_measured_beyond_an_empty_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    """The times are made up: on a machine with other work, 200 blocks may be loaded faster than two."""
    really = commands.seconds

    def loaded_in(command: Sequence[str], environment: dict[str, str]) -> tuple[float, float]:
        really(command, environment)
        return 0.25 + 0.01 * len(quadvis.load(Path(command[-1])).graph.nodes), 0.0

    monkeypatch.setattr(commands, "seconds", loaded_in)
    (row,) = commands.load(1, counts=(200,))
    assert (row.what, row.value) == ("loading 200 blocks", pytest.approx(1.98))


@pytest.mark.slow
def test_the_chosen_engine_is_compared_with_the_faster_one(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = {"python": 3.0, "native": 2.0, "auto": 2.25}
    commands_seen: list[Sequence[str]] = []

    def measured_in(command: Sequence[str], environment: dict[str, str]) -> tuple[float, float]:
        commands_seen.append(command)
        return taken[command[-1]], 0.0

    monkeypatch.setattr(choices, "seconds", measured_in)
    found = list(choices.choices(1))
    assert [row.value for row in found] == [0.25] * len(golden.cases())
    assert found[0].what == "blackout.yaml: interpreted 3.00 s, machine code 2.00 s"
    assert {Path(command[4]).name for command in commands_seen} == {name for name, _ in golden.cases()}


def test_a_command_that_ends_in_an_error_has_no_time() -> None:
    with pytest.raises(QuadvisError, match="ended with exit code 3"):
        commands.seconds((sys.executable, "-c", "raise SystemExit(3)"), {})


def test_every_numeric_block_of_the_library_can_be_made_to_be_compiled() -> None:
    catalogue = Catalogue()
    blocks = map(catalogue.find, catalogue.names())
    numeric = [block for block in blocks if block.numeric and not block.example]
    required = {name for block in numeric for name, param in block.interface.params.items() if param.required}
    assert required <= whole_library.VALUES.keys()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["hoverr"], "bench: there is no section 'hoverr'; did you mean 'hover'?\n"),
        (["--rounds", "0"], "bench: --rounds: '0' is not a whole number from 1 on; write --rounds N\n"),
        (
            ["--tasks", "a,c10"],
            "bench: --tasks: there is no 'c10'; did you mean 'c100'?; write --tasks A,B\n",
        ),
    ],
)
def test_wrong_arguments_are_one_sentence(arguments: list[str], sentence: str) -> None:
    done: subprocess.CompletedProcess[str] = run_script(TOOL, *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", sentence)
