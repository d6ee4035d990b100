"""The processes of a sweep: started, fed, ended with the sweep however it ends.

Workers are spawned: each begins as a fresh interpreter, so nothing of the first process (locks, threads of
OpenCV, a diagram that was run before) leaks into a run, and the limits on threads stand before numpy is
imported. A fork server would start them some 0.2 s earlier, but with what it had imported and set before.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from queue import Empty, SimpleQueue
from types import ModuleType

from quadvis.errors import RunError
from quadvis.machine.interrupts import held_back
from quadvis.sweeps.worker import ONE_THREAD, Job, Row, begin, perform

IDLE = 1.0  # s without a row after which the caller has its turn all the same


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def perform_all(jobs: Sequence[Job], workers: int) -> Generator[Row | None, None, None]:
    """Yield the rows as they come, and None after a second without one; closing it ends the workers at once.

    RunError if a worker is killed.
    """
    if not jobs:
        return
    before = set(multiprocessing.active_children())
    with held_back():  # Python's own helper shall outlive the terminal as well
        resource_tracker.ensure_running()
    executor = ProcessPoolExecutor(
        min(workers, len(jobs)), multiprocessing.get_context("spawn"), initializer=begin
    )
    finished = False
    try:
        with _launching():
            futures = [executor.submit(perform, job) for job in jobs]  # this starts the processes
        done: SimpleQueue[Future[Row]] = SimpleQueue()
        for future in futures:
            future.add_done_callback(done.put)
        left = len(futures)
        while left:
            try:
                row = done.get(timeout=IDLE).result()
                left -= 1
            except Empty:
                row = None
            yield row
        finished = True
    except BrokenProcessPool:
        problem = "a worker process was killed, perhaps by the system for lack of memory"
        raise RunError(f"{problem}; try fewer with --workers") from None
    finally:
        children: set[BaseProcess] = set(multiprocessing.active_children()) - before
        executor.shutdown(wait=finished, cancel_futures=True)
        for child in children if not finished else ():
            child.kill()
        for child in children:
            child.join()


@contextmanager
def _launching() -> Iterator[None]:
    """Let processes begin with one thread for each library, deaf to the terminal, without the main script.

    The workers need nothing of the script, which then works without `if __name__ == "__main__":`.
    """
    environment = {name: os.environ.get(name) for name in ONE_THREAD}
    main = sys.modules["__main__"]
    os.environ.update(ONE_THREAD)
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        with held_back():
            yield
    finally:
        sys.modules["__main__"] = main
        for name, value in environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
