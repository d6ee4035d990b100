"""The processes of a sweep: start them, give them jobs, and end them whenever the sweep ends.

Workers are spawned: each begins as a fresh interpreter. So nothing of the first process (locks, OpenCV's
threads, an earlier diagram) leaks into a run, and the limits on threads are set before numpy is imported. A
fork server would start workers some 0.2 s earlier, but with its own imports and settings.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import chain, islice
from multiprocessing.process import BaseProcess
from queue import Empty, SimpleQueue
from typing import Any

from quadvis.errors import RunError
from quadvis.errors.caller import IS_COMMAND
from quadvis.machine.processes import launching
from quadvis.sweeps.worker import Job, Row, begin, perform

IDLE = 1.0  # s without a row after which the caller gets None
AHEAD = (
    64  # tasks that wait for each worker: no worker waits while rows are written, and few tasks are in memory
)


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def perform_all(jobs: Iterable[Job], workers: int) -> Generator[Row | None, None, None]:
    """Yield the rows as they come, and None after a second without one; closing it ends the workers.

    Jobs are taken from ``jobs`` as they are needed. RunError if a worker is killed.
    """
    first = list(islice(jobs := iter(jobs), workers))
    if not first:
        return
    before = set(multiprocessing.active_children())
    with launching():
        executor = ProcessPoolExecutor(
            len(first),
            multiprocessing.get_context("spawn"),
            initializer=begin,
            initargs=(IS_COMMAND.get(),),
        )
    finished = False

    def submit(job: Job) -> Any:
        with launching():  # the first ones start the processes
            return executor.submit(perform, job)

    try:
        yield from results_of(submit, chain(first, jobs), AHEAD * len(first), set())
        finished = True
    except BrokenProcessPool:
        problem = "a worker process was killed, perhaps by the system for lack of memory"
        raise RunError(f"{problem}; try fewer workers") from None
    finally:
        children: set[BaseProcess] = set(multiprocessing.active_children()) - before
        if not finished:
            for child in children:
                child.kill()
        # Waits for the executor's own thread, which ends once the workers are gone. Left alone, that thread
        # closes a pipe which the interpreter writes to at its exit, without a lock.
        executor.shutdown(wait=True, cancel_futures=True)
        for child in children:
            child.join()


def results_of(
    submit: Callable[[Any], Any], tasks: Iterator[Any], most: int, pending: set[Any]
) -> Generator[Any, None, None]:
    """Yield the results of tasks as they come, and None after a second without one.

    ``submit`` gives a task to the workers, and returns its future, one of ``concurrent.futures`` or what has
    the same methods. At most ``most`` of them are ``pending``, however many tasks there are.
    """
    done: SimpleQueue[Any] = SimpleQueue()

    def more() -> None:
        for task in islice(tasks, most - len(pending)):
            future = submit(task)
            pending.add(future)
            future.add_done_callback(done.put)

    more()
    while pending:
        try:
            future = done.get(timeout=IDLE)
        except Empty:
            yield None
            continue
        pending.remove(future)
        more()
        yield future.result()
