"""The program that measures the engine runs, and each table has the rows that it promises."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

import quadvis

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench"


def rows(*arguments: str) -> dict[str, list[dict[str, Any]]]:
    done = run_script(TOOL, *arguments, "--rounds", "1", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    found: dict[str, list[dict[str, Any]]] = json.loads(done.stdout)
    return found


def test_the_engine_stands_beside_the_loop_by_hand() -> None:
    found = rows("chain", "thirty")
    for table, count in (("chain", 4), ("thirty", 2)):
        assert [row["ratio"] == 1.0 for row in found[table]] == [True, False] * (count // 2)
        assert all(row["value"] > 0.0 for row in found[table])


def test_the_time_of_a_run_is_shared_out_among_its_blocks_and_the_engine() -> None:
    bench = loaded(TOOL)
    diagram = quadvis.load(bench.HOVER, variant="geometric", stop_time="0.5 s")
    shares = bench._shares(diagram)
    engine = shares.pop("engine: order, solver, checks")
    assert {node.path for node in diagram.graph.nodes} >= shares.keys() >= {"craft", "imu", "eyes/camera"}
    assert engine > 0.0 and min(shares.values()) > 0.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["chan"], "bench: there is no section 'chan'; did you mean 'chain'?\n"),
        (["--rounds", "0"], "bench: --rounds: '0' is not a whole number from 1 on; write --rounds N\n"),
        (["--fast"], "bench: there is no option '--fast'; choose from '--rounds', '--json'\n"),
    ],
)
def test_wrong_arguments_are_one_sentence(arguments: list[str], sentence: str) -> None:
    done: subprocess.CompletedProcess[str] = run_script(TOOL, *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", sentence)
