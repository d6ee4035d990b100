"""What the second stage, ``pytest -m slow``, tries beyond the first, and ``pytest -m long`` beyond both."""

import re
import zlib
from collections.abc import Iterable, Sequence
from typing import Any

import pytest

# What takes half a minute or more of the second stage. It comes first: none of it is left alone at the end.
LONGEST = (
    "tests/tools/test_site.py::test_all_pages",
    "tests/diagrams/test_camera_faults.py::test_no_fault",
    "tests/quadvis/test_book.py::test_the_largest",
    "tests/blocks/test_every_block.py::test_every_block_conforms[estimation.",
    "tests/blocks/vision/test_rays.py::test_machine_code",
    "tests/blocks/plant/test_mujoco_rotorcraft.py::test_the_hover_flies",
    "tests/diagrams/test_guides.py::test_a_guide_can_be_followed",
    "tests/quadvis/test_shipped.py::test_a_wheel",
    "tests/tools/test_bench.py::test_machine_code",
    "tests/tools/test_bench_realtime.py::test_the_table",
)


def longest_first(items: list[pytest.Item]) -> None:
    """Move what takes longest to the front; all else keeps its order."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))


def share(items: Sequence[pytest.Item], which: str) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests of one share, such as the second of five, "2/5", and all others.

    The name of a test says to which share it belongs, so that other tests which come or go move none. All
    shares together are all tests. UsageError if there is no such share.
    """
    found = re.fullmatch(r"([1-9][0-9]?)/([1-9][0-9]?)", which, re.ASCII)
    if found is None or int(found[1]) > int(found[2]):
        raise pytest.UsageError(f"--share {which}: write which share of how many, such as 2/5")
    number, shares = int(found[1]) - 1, int(found[2])
    parts: tuple[list[pytest.Item], list[pytest.Item]] = ([], [])
    for item in items:
        parts[zlib.crc32(item.nodeid.encode()) % shares != number].append(item)
    return parts


def mostly_slow(cases: Iterable[Any], quick: int = 1, slow: int | None = None) -> list[Any]:
    """Have the first cases tried in the first stage, all others in the second.

    With ``slow``, so many are tried in the second, and what is left only by a person.
    """
    entries = [case if isinstance(case, tuple) else (case,) for case in cases]
    last = len(entries) if slow is None else quick + slow
    return [
        pytest.param(
            *entry, marks=() if number < quick else pytest.mark.slow if number < last else pytest.mark.long
        )
        for number, entry in enumerate(entries)
    ]
