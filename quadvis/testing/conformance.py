"""The suite of checks that every block class must pass, in the standard library and in every other library.

check_block(Fan, given={"curve": "fan.csv"})  # all checks; AssertionError reports every fault

@pytest.mark.parametrize("name", CHECKS)      # or one by one
def test_fan(name):
    CHECKS[name](Subject(Fan, given={"curve": "fan.csv"}))
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from quadvis.block import Block
from quadvis.testing.checks.compiled import compiles
from quadvis.testing.checks.devices import frames_follow_from_commands, outlives_hostile_bytes
from quadvis.testing.checks.form import all_declarations_used, documented, one_block_in_its_module, tested
from quadvis.testing.checks.parameters import refuses_bad_parameters, refuses_before_a_run
from quadvis.testing.checks.returned import returns_what_it_declares
from quadvis.testing.checks.stamps import outlives_hostile_stamps
from quadvis.testing.checks.states import (
    inputs_not_asked_for_do_not_matter,
    output_changes_nothing,
    outside_changes_nothing,
    repeats_after_restore,
    starts_the_same,
    work_is_of_one_tick,
)
from quadvis.testing.rig import Subject

__all__ = ["CHECKS", "Subject", "check_block", "excuse"]


def check_block(
    block: type[Block],
    *,
    given: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Sequence[Any]] | None = None,
    test: Path | None = None,
) -> None:
    """Run all checks over a block class; AssertionError reports every fault. See ``Subject``.

    The check ``compiles`` runs only if numba is installed.
    """
    subject = Subject(block, given or {}, inputs or {}, test)
    problems = []
    for name, check in CHECKS.items():
        if name == "compiles" and find_spec("numba") is None:
            continue
        try:
            check(subject)
        except AssertionError as error:
            problems.append(f"{block.__name__}: {name}: {error}")
        except Exception as error:
            problems.append(f"{block.__name__}: {name}: {type(error).__name__}: {error}")
    if problems:
        raise AssertionError("\n".join(problems))


# The checks that each tag of a block class switches off. The text of the tag says why they cannot hold.
CANNOT_HOLD = {
    "not_replayable": {
        "starts_the_same", "inputs_not_asked_for_do_not_matter", "work_is_of_one_tick",
        "repeats_after_restore", "outlives_hostile_stamps",
    },
    "not_restorable": {"starts_the_same", "repeats_after_restore"},
}  # fmt: skip


def excuse(check: str, block: type[Block]) -> str:
    """Return the text of the tag that says why a check cannot hold for a block; "" if the check must hold."""
    reasons = (str(getattr(block, tag)) for tag, checks in CANNOT_HOLD.items() if check in checks)
    return next(filter(None, reasons), "")


def _unless_excused(check: Callable[[Subject], None]) -> Callable[[Subject], None]:
    @functools.wraps(check)
    def run(subject: Subject) -> None:
        if not excuse(check.__name__, subject.block):
            for each in subject.of_any_number(COMPILED if check is compiles else INTERPRETED):
                check(each)

    return run


# How many signals an input of any number gets; to compile takes seconds.
INTERPRETED, COMPILED = (1, 2, 3), (3,)
CHECKS: dict[str, Callable[[Subject], None]] = {
    check.__name__: _unless_excused(check)
    for check in (
        one_block_in_its_module,
        documented,
        tested,
        all_declarations_used,
        refuses_bad_parameters,
        refuses_before_a_run,
        starts_the_same,
        output_changes_nothing,
        outside_changes_nothing,
        inputs_not_asked_for_do_not_matter,
        work_is_of_one_tick,
        repeats_after_restore,
        outlives_hostile_stamps,
        frames_follow_from_commands,
        outlives_hostile_bytes,
        returns_what_it_declares,
        compiles,
    )
}
