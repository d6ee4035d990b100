"""A worker of a cluster: it keeps the files of sweeps, and does their jobs one at a time."""

from __future__ import annotations

import shutil
import threading
from contextlib import chdir
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from distributed import WorkerPlugin

from quadvis.errors import QuadvisError
from quadvis.errors.caller import IS_COMMAND
from quadvis.sweeps.parcel import Parcel, difference, moved, moved_back, moved_job
from quadvis.sweeps.worker import Job, Row, perform

_parcels: dict[str, tuple[Parcel, Path]] = {}  # by key
_running = threading.Lock()  # a diagram is loaded once for successive runs


class ParcelStore(WorkerPlugin):
    """Gives each worker a parcel, those that come later, too."""

    def __init__(self, parcel: Parcel) -> None:
        self.parcel, self.name = parcel, f"quadvis {parcel.key}"

    def setup(self, worker: Any) -> None:
        """Write the files into a folder of the worker's."""
        folder = Path(mkdtemp(prefix="quadvis-", dir=worker.local_directory))
        self.parcel.unpack(folder)
        _parcels[self.parcel.key] = self.parcel, folder

    def teardown(self, worker: Any) -> None:
        """Remove them."""
        _, folder = _parcels.pop(self.parcel.key, (None, None))
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)


def perform_there(jobs: tuple[Job, ...], parcel: str) -> list[Row]:
    """Do some runs of a sweep, as `perform`, with the files of a parcel.

    QuadvisError if the sweep is of other software.
    """
    found, folder = _parcels[parcel]
    if problem := difference(found.software):
        raise QuadvisError(f"a worker of the cluster {problem}")
    with _running, chdir(moved(found.directory, folder)):
        IS_COMMAND.set(found.is_command)
        return [moved_back(perform(moved_job(job, folder)), folder) for job in jobs]
