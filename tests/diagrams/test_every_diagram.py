"""Every diagram of the repository is checked and flown for two seconds, each variant too."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

import quadvis
from quadvis.api import Diagram
from quadvis.engine.engine import Engine, Snapshot

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
CASES = [
    (path.name, variant)
    for path in sorted(DIAGRAMS.glob("*.yaml"))
    for variant in (None, *yaml.safe_load(path.read_text()).get("variants", {}))
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the diagrams, so that what a diagram writes beside itself stays out of the repository."""
    return Path(shutil.copytree(DIAGRAMS, tmp_path_factory.mktemp("repository") / "diagrams"))


def load(folder: Path, name: str, variant: str | None) -> Diagram:
    """Return a diagram that stops after two seconds, or when it wants to if that is earlier."""
    loaded = quadvis.load(folder / name, variant=variant)
    return quadvis.load(folder / name, variant=variant, stop_time=min(2.0, loaded.duration))


@pytest.mark.parametrize(("name", "variant"), CASES)
def test_every_diagram_gives_all_its_signals_and_repeats_to_the_bit_with_the_same_seed(
    folder: Path, name: str, variant: str | None
) -> None:
    diagram = load(folder, name, variant)
    first = diagram.run()
    assert first.duration == diagram.duration
    for signal in first:
        times = first.times(signal)
        assert len(times) == len(first[signal]) > 0 and times[0] >= 0.0 and times[-1] <= diagram.duration
        assert (np.diff(times) > 0.0).all()
    again = load(folder, name, variant).run()
    assert list(again) == list(first)
    assert all(first[signal].tobytes() == again[signal].tobytes() for signal in first)


def test_the_hover_is_among_them_with_a_variant_for_the_second_method() -> None:
    assert {("hover.yaml", None), ("hover.yaml", "plane")} <= set(CASES)


@pytest.mark.parametrize(("name", "variant"), CASES)
def test_every_diagram_repeats_from_a_snapshot_in_the_same_engine_and_in_a_fresh_one(
    folder: Path, name: str, variant: str | None
) -> None:
    diagram = load(folder, name, variant)
    engine, fresh = Engine(diagram.graph, diagram.seed), Engine(diagram.graph, diagram.seed)
    half = diagram.ticks // 2
    with engine:
        engine.run(half)
        snapshot = engine.snapshot()
        engine.run(diagram.ticks - half)
        first = engine.snapshot()
        again = repeated(engine, snapshot, diagram.ticks)
    with fresh:  # not before the other is closed: they write the same files
        for found in (again, repeated(fresh, snapshot, diagram.ticks)):
            assert found.memory == first.memory
            for one, other in zip(found.frames, first.frames, strict=True):
                assert np.array_equal(one.pixels, other.pixels)
                assert (repr(one.stamp), one.sequence) == (repr(other.stamp), other.sequence)


def repeated(engine: Engine, snapshot: Snapshot, ticks: int) -> Snapshot:
    """Return the signals of a run continued from a snapshot."""
    engine.restore(snapshot)
    engine.run(ticks - snapshot.tick)
    return engine.snapshot()
