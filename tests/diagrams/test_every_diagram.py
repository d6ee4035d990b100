"""Every diagram of the repository, by itself and with each of its variants, is flown for a second and a half.

Those that need devices or another program are flown by tests of their own.
See golden.py for how to renew the golden file.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import Diagram
from quadvis.engine.engine import Engine, Snapshot
from tests.diagrams.golden import DIAGRAMS, FILE, cases, digest, loaded, title, with_programs

GOLDEN = json.loads(FILE.read_text())
CASES = cases()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the diagrams, so that what a diagram writes beside itself stays out of the repository."""
    return Path(shutil.copytree(DIAGRAMS, tmp_path_factory.mktemp("repository") / "diagrams"))


# Of the module, so that the tests of one diagram follow each other and share its flight.
@pytest.fixture(scope="module", params=CASES, ids=lambda case: title(*case))
def case(request: pytest.FixtureRequest) -> tuple[str, str | None]:
    name, variant = request.param
    return name, variant


@pytest.fixture(scope="module")
def diagram(folder: Path, case: tuple[str, str | None]) -> Diagram:
    return loaded(folder, *case)


@pytest.fixture(scope="module")
def flight(diagram: Diagram) -> Any:
    return diagram.run()


def test_the_golden_file_knows_every_diagram_and_variant() -> None:
    assert list(GOLDEN) == [title(*case) for case in (*CASES, *with_programs())]


def test_what_flies_with_another_program_is_known_by_its_hash() -> None:
    found = with_programs()
    assert found == (("betaflight.yaml", None), ("betaflight.yaml", "failsafe"))
    for name, variant in found:
        assert quadvis.load(DIAGRAMS / name, variant=variant).hash == GOLDEN[title(name, variant)]["hash"]


def test_the_hover_is_among_them_with_a_variant_for_the_second_method() -> None:
    assert {("hover.yaml", None), ("hover.yaml", "plane")} <= set(CASES)


def test_hash_and_signals_are_those_of_the_golden_file(case: tuple[str, str | None], flight: Any) -> None:
    name, variant = case
    golden = GOLDEN[title(name, variant)]
    assert quadvis.load(DIAGRAMS / name, variant=variant).hash == golden["hash"]
    assert digest(flight) == pytest.approx(golden["signals"], rel=1e-6, abs=1e-9)


@pytest.mark.slow  # in the first stage the golden file and the fresh engine notice nearly all of it
def test_every_diagram_gives_all_its_signals_and_as_machine_code_the_same_to_the_bit(
    folder: Path, case: tuple[str, str | None], diagram: Diagram, flight: Any
) -> None:
    name, variant = case
    assert flight.duration == diagram.duration
    for signal in flight:
        times = flight.times(signal)
        assert len(times) == len(flight[signal]) > 0 and times[0] >= 0.0 and times[-1] <= diagram.duration
        assert (np.diff(times) > 0.0).all()
    again = quadvis.load(folder / name, variant=variant, stop_time=diagram.duration).run(engine="native")
    assert list(again) == list(flight)
    assert all(flight[signal].tobytes() == again[signal].tobytes() for signal in flight)


def test_every_diagram_repeats_from_a_snapshot_in_the_same_engine_and_in_a_fresh_one(
    diagram: Diagram,
) -> None:
    engine, fresh = Engine(diagram.graph, diagram.seed), Engine(diagram.graph, diagram.seed)
    ticks = diagram.ticks // 2  # 0.75 s
    half = ticks // 2
    with engine:
        engine.run(half)
        snapshot = engine.snapshot()
        engine.run(ticks - half)
        first = engine.snapshot()
        again = repeated(engine, snapshot, ticks)
    with fresh:  # not before the other is closed: they write the same files
        for found in (again, repeated(fresh, snapshot, ticks)):
            assert found.memory == first.memory
            for one, other in zip(found.frames, first.frames, strict=True):
                assert np.array_equal(one.pixels, other.pixels)
                assert (repr(one.stamp), one.sequence) == (repr(other.stamp), other.sequence)


def repeated(engine: Engine, snapshot: Snapshot, ticks: int) -> Snapshot:
    """Return the signals of a run continued from a snapshot."""
    engine.restore(snapshot)
    engine.run(ticks - snapshot.tick)
    return engine.snapshot()
