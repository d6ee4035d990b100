"""What the workers of a cluster need besides jobs: files, and the same software as here."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from quadvis.errors import sentence
from quadvis.errors.caller import IS_COMMAND
from quadvis.library.catalogue import STANDARD
from quadvis.sweeps.worker import Job, Row

PACKAGES = ("quadvis", STANDARD, "quadvis_vision")
DECISIVE = ("numpy", "opencv-python-headless", "numba", "llvmlite")


@dataclass(frozen=True)
class Parcel:
    """Files by their absolute paths, and the software for which they are.

    ``key`` is the digest of the files. They lie on a worker as they lie here, under a folder of its own, and
    jobs run there in the working ``directory``.
    """

    directory: str
    files: Mapping[str, bytes]
    software: Mapping[str, str]
    is_command: bool
    key: str

    @staticmethod
    def of(paths: Iterable[Path]) -> Parcel:
        """Return the parcel of these files, without the code of quadvis, which workers have."""
        code, digest, files = _folders(), hashlib.sha256(), {}
        for path in sorted({Path(os.path.abspath(path)) for path in paths}):
            ours = path.suffix == ".py" and any(path.is_relative_to(folder) for folder in code)
            if path.is_file() and not ours:
                files[str(path)] = content = path.read_bytes()
                digest.update(f"{path}\0{len(content)}\0".encode() + content)
        directory = os.getcwd()
        digest.update(directory.encode())
        return Parcel(directory, files, software(), IS_COMMAND.get(), digest.hexdigest())

    def unpack(self, folder: Path) -> None:
        """Write all files below a folder."""
        moved(self.directory, folder).mkdir(parents=True)
        for name, content in self.files.items():
            path = moved(name, folder)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def moved(path: str, folder: Path) -> Path:
    """Return where a file of an absolute path lies below a folder; a relative path stays."""
    return folder / Path(path).relative_to(Path(path).anchor) if os.path.isabs(path) else Path(path)


def moved_job(job: Job, folder: Path) -> Job:
    """Return the job with its files below a folder."""

    def there(path: str) -> str:
        return str(moved(path, folder))

    asked = job.configuration
    configuration = replace(asked, file=there(asked.file), params=tuple(map(there, asked.params)))
    files = {there(path): digest for path, digest in job.files.items()}
    return replace(job, configuration=configuration, files=files)


def moved_back(row: Row, folder: Path) -> Row:
    """Return the row with the paths that are here."""
    return replace(row, failure=row.failure.replace(str(folder), ""))


@cache
def software() -> Mapping[str, str]:
    """Return what decides the numbers of a run: versions, and the SHA-256 of the code of quadvis."""
    code = hashlib.sha256()
    for folder in _folders():
        for file in sorted(folder.rglob("*.py")):
            code.update(f"{folder.name}/{file.relative_to(folder)}\0".encode() + file.read_bytes())
    found = {"quadvis": f"code {code.hexdigest()[:12]}", "Python": platform.python_version()}
    found["the processor"] = platform.machine()
    for name in DECISIVE:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def difference(theirs: Mapping[str, str]) -> str:
    """Return what is not as here, in a sentence without its subject; "" if all is."""
    for name, version in software().items():
        other = theirs.get(name, "not installed")
        if other != version:
            remedy = "install the same there, since one table is of one software"
            return sentence(f"has another {name}: {other}, here it is {version}", remedy)
    return ""


def _folders() -> list[Path]:
    """Return the folders of the packages of quadvis."""
    specs = filter(None, map(find_spec, PACKAGES))
    return [Path(place) for spec in specs for place in spec.submodule_search_locations or ()]
