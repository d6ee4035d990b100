"""One program on one task, in a process of its own: ``python -m benchmarks.worker PROGRAM TASK``.

It answers on standard output, a line of JSON for each line on standard input: "STEPS" is a run of so many
steps from the start, answered by its CPU seconds and its values. The first line of all says what
loading and building cost, or why the program cannot be had.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

from benchmarks.tasks import Task


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return the result of some work, and the CPU seconds of this process and of its ended children."""
    begin = time.process_time() + sum(os.times()[2:4])
    result = work()
    return result, time.process_time() + sum(os.times()[2:4]) - begin


def serve(program: str, name: str) -> None:
    """Answer until standard input ends."""
    answers, sys.stdout = sys.stdout, sys.stderr  # programs print

    def answer(**facts: Any) -> None:
        print(json.dumps(facts), file=answers, flush=True)

    task = Task.named(name)
    module = import_module(f"benchmarks.programs.{program}")
    try:
        version, loading = timed(module.load)
    except ImportError as error:
        answer(missing=str(error))
        return
    try:
        prepare, building = timed(lambda: module.build(task))
        answer(version=version, load=loading, build=building)
        for line in sys.stdin:
            values, seconds = timed(prepare(int(line)))
            answer(seconds=seconds, values=[float(value) for value in values])
    except Exception as error:
        answer(failed=f"{type(error).__name__}: {error}")


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):
        serve(sys.argv[1], sys.argv[2])
