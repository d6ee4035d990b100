"""Noise belongs to a name: the path of a block, or the stream that its entry names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.errors import DiagramError

FLAT = "  gust: {block: plant.gust, rate: fast}\n"
PART = "{quadvis: 1, name: air, ports: {}, blocks: {gust: {block: plant.gust, rate: fast%s}}}"


def wind(folder: Path, blocks: str, inner: str = "", name: str = "gust") -> np.ndarray:
    (folder / "air.yaml").write_text(PART % inner)
    path = folder / "case.yaml"
    path.write_text(f"quadvis: 1\nname: case\nrates: {{fast: 10 Hz}}\nstop_time: 1 s\nblocks:\n{blocks}")
    diagram = quadvis.load(path)
    (folder / "resolved.yaml").write_text(diagram.resolved)
    found = diagram.run()[f"{name}.wind"]
    again = quadvis.load(folder / "resolved.yaml").run()[f"{name}.wind"]
    assert again.tobytes() == found.tobytes()
    return found


def test_a_block_that_moves_into_a_part_keeps_its_noise_by_its_stream(tmp_path: Path) -> None:
    before = wind(tmp_path, FLAT)
    moved = wind(tmp_path, "  air: {part: air.yaml}\n", ", stream: gust", "air/gust")
    assert moved.tobytes() == before.tobytes()
    other = wind(tmp_path, "  air: {part: air.yaml}\n", "", "air/gust")
    assert not np.array_equal(other, before)


def test_the_stream_of_a_part_takes_the_place_of_its_path(tmp_path: Path) -> None:
    before = wind(tmp_path, "  air: {part: air.yaml}\n", "", "air/gust")
    renamed = wind(tmp_path, "  wind: {part: air.yaml, stream: air}\n", "", "wind/gust")
    assert renamed.tobytes() == before.tobytes()


def test_two_blocks_cannot_have_one_stream(tmp_path: Path) -> None:
    two = "  one: {part: air.yaml}\n  two: {part: air.yaml}\n"
    wind(tmp_path, two, "", "one/gust")
    with pytest.raises(DiagramError) as caught:
        wind(tmp_path, two, ", stream: gust", "one/gust")
    place = f"{tmp_path / 'air.yaml'}:1:91"
    assert str(caught.value) == (
        f"{place}: block 'two/gust': 'one/gust' has the stream 'gust', too: their noise would be the same; "
        "give each a name of its own"
    )


def test_blocks_without_noise_may_have_one_stream(tmp_path: Path) -> None:
    wind(tmp_path, FLAT + "  a: {block: sources.sine, rate: fast, stream: gust}\n")


def test_a_stream_is_a_name(tmp_path: Path) -> None:
    with pytest.raises(DiagramError, match="'stream' must be a name, or names joined by '/', not '2 x'"):
        wind(tmp_path, "  gust: {block: plant.gust, rate: fast, stream: 2 x}\n")
