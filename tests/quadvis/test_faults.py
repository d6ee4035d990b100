"""Every defect is reported once, at its place, with its remedy. How cases are written: `corpus.py`."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from quadvis.api import check, load
from quadvis.errors import DiagramError, Fault
from quadvis.errors.caller import command_words

from .corpus import Case, all_cases


def faults(case: Case, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[Fault]:
    """Return the report on a case: with all variants, or with the options of the case."""
    case.write(folder)
    monkeypatch.chdir(folder)
    parser = argparse.ArgumentParser()
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--params", action="append", default=[])
    parser.add_argument("--variant")
    parser.add_argument("--stop-time")
    parser.add_argument("--seed", type=int)
    options = parser.parse_args(case.arguments)
    settings = options.set
    try:
        with command_words():
            if options.variant or options.stop_time or options.seed:
                load(
                    "case.yaml",
                    variant=options.variant,
                    settings=settings,
                    params=options.params,
                    stop_time=options.stop_time,
                    seed=options.seed,
                )
            else:
                check("case.yaml", settings, options.params)
    except DiagramError as error:
        return error.faults
    return []


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: case.title)
def test_the_right_faults_are_told_at_the_right_places(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = faults(case, tmp_path, monkeypatch)
    assert sorted(map(str, told)) == case.expected()


def test_the_corpus_has_a_title_for_every_case() -> None:
    titles = [case.title for case in all_cases()]
    assert len(titles) > 100
    assert len(set(titles)) == len(titles)
