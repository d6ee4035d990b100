"""What a bridge makes of what a target says of its signals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadvis.bridge.blocks import bridged_blocks, chosen_names, chosen_signals, is_whole, slots_of
from quadvis.errors import QuadvisError
from quadvis.output.recording import RecordedBlock, RecordedPort


def fact(name: str, kind: str = "float64", shape: tuple[int, ...] = (), *also: str) -> dict[str, Any]:
    return {"name": name, "also": list(also), "type": kind, "shape": list(shape), "unit": "m", "task": "fast"}


FACTS = [
    fact("craft.position", "float64", (3,)),
    fact("craft.speed"),
    fact("eyes/detector.found", "bool", (), "eyes.found"),
]


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ([], [0, 1, 2]),
        (["craft.*"], [0, 1]),
        (["eyes.found", "craft.speed"], [1, 2]),
        (["eyes.*"], [2]),
        (["eyes/camera.frame"], []),
    ],
)
def test_names_and_patterns_choose_signals(names: list[str], found: list[int]) -> None:
    assert chosen_signals(FACTS, names, ["eyes/camera.frame"]) == [FACTS[number] for number in found]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("craft.positon", "there is no signal 'craft.positon'; did you mean 'craft.position'?"),
        (
            "craft.position[2]",
            "there is no signal 'craft.position[2]'; name all of the signal, 'craft.position'",
        ),
        (
            "nothing.*",
            "there is no signal 'nothing.*'; choose from 'craft.position', 'craft.speed', "
            "'eyes/detector.found', 'eyes.found'",
        ),
    ],
)
def test_what_means_no_signal_is_refused(name: str, sentence: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        chosen_signals(FACTS, [name])
    assert str(caught.value) == sentence


def test_pictures_are_chosen_in_the_same_way() -> None:
    assert chosen_names(["eyes/camera.frame"], []) == ["eyes/camera.frame"]
    assert chosen_names(["eyes/camera.frame"], ["craft.*"]) == []


def test_blocks_have_their_ports_as_in_a_log() -> None:
    craft, detector = bridged_blocks(FACTS)
    assert craft == RecordedBlock(
        "/craft",
        (RecordedPort("position", "float64", (3,), "m"), RecordedPort("speed", "float64", (), "m")),
        "fast",
    )
    assert detector.path == "/eyes/detector" and detector.ports[0].type == "bool"


def test_slots_are_the_bits_of_numbers_and_whole_numbers() -> None:
    block = RecordedBlock(
        "/a", (RecordedPort("x"), RecordedPort("n", "int64", (2,)), RecordedPort("b", "bool"))
    )
    values = np.array([[0.1, -3.0, 2.0**53, 1.0], [np.nan, 0.0, 1.0, 0.0]])
    assert is_whole(block, values).tolist() == [True, True]
    slots = slots_of(block, values)
    np.testing.assert_array_equal(slots[:, 0].view(np.float64), values[:, 0])
    assert slots[:, 1:].tolist() == [[-3, 2**53, 1], [0, 1, 0]]
    values[1, 2] = np.nan
    assert is_whole(block, values).tolist() == [True, False]
