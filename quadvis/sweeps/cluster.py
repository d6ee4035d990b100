"""Runs of a sweep on a cluster of Dask: jobs go to its workers, with the files that they need.

A worker has its own quadvis, and is refused if that is another one: one table is of one software. Files, the
user's own blocks among them, travel as they are.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import Any

from quadvis.errors import QuadvisError, RunError, quoted
from quadvis.sweeps.parcel import Parcel, difference, software
from quadvis.sweeps.pool import results_of
from quadvis.sweeps.worker import Job, Row

PATIENCE = 10.0  # s in which the scheduler must answer and have a worker
MOST_JOBS = 16  # of one task: what a lost worker repeats
AHEAD = 8  # tasks that wait for each thread
SHARES = 8  # tasks for each thread of the cluster, at least, if there are so many jobs


def perform_on(
    address: str, jobs: Iterable[Job], count: int, paths: Iterable[Path]
) -> Generator[Row | None, None, None]:
    """Yield the rows as they come, and None after a second without one; closing it gives the jobs up.

    There are ``count`` jobs, which are taken from ``jobs`` as they are needed; ``paths`` are the files that
    they need. What a worker that is lost has not done goes to another one. QuadvisError if no cluster is at
    the address, or if a worker has other software; RunError if one job after the other has lost its worker.
    """
    first = list(islice(jobs := iter(jobs), 1))
    if not first:
        return
    with _client(address) as client:
        _check_workers(client, address)
        from quadvis.sweeps.cluster_worker import ParcelStore, perform_there

        parcel = Parcel.of(paths)
        store = ParcelStore(parcel)
        client.register_plugin(store)
        threads = sum(client.nthreads().values()) or 1
        size = max(1, min(MOST_JOBS, count // (SHARES * threads)))
        pending: set[Any] = set()

        def submit(task: tuple[Job, ...]) -> Any:
            return client.submit(perform_there, task, parcel=parcel.key, pure=False)

        try:
            tasks = _tasks(chain(first, jobs), size)
            yield from _rows(results_of(submit, tasks, AHEAD * threads, pending))
        finally:
            client.cancel(list(pending))
            client.unregister_worker_plugin(store.name)


def _tasks(jobs: Iterator[Job], size: int) -> Iterator[tuple[Job, ...]]:
    while task := tuple(islice(jobs, size)):
        yield task


def _client(address: str) -> Any:
    try:
        client: Any = import_module("distributed").Client
    except ImportError:
        remedy = "pip install 'quadvis[cluster]'"
        raise QuadvisError(f"a sweep on a cluster needs the package distributed; {remedy}") from None
    try:
        return client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError):
        remedy = "start 'dask scheduler', and give its address, such as tcp://host:8786"
        raise QuadvisError(f"no scheduler of Dask answers at {quoted(address)}; {remedy}") from None


def _check_workers(client: Any, address: str) -> None:
    """Wait for a worker; refuse those with other software."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        remedy = f"start some by 'dask worker {address} --nworkers auto --nthreads 1'"
        raise QuadvisError(f"the cluster at {quoted(address)} has no workers; {remedy}") from None
    for worker, theirs in client.run(software, on_error="return").items():
        if isinstance(theirs, BaseException):
            raise QuadvisError(f"the worker {worker} cannot do a sweep of quadvis: {theirs}")
        if problem := difference(theirs):
            raise QuadvisError(f"the worker {worker} {problem}")


def _rows(results: Iterator[list[Row] | None]) -> Iterator[Row | None]:
    from distributed import KilledWorker

    try:
        for found in results:
            yield from (None,) if found is None else found
    except KilledWorker:
        problem = "some jobs have lost one worker after the other, perhaps for lack of memory"
        raise RunError(f"{problem}; try fewer workers on each machine") from None
