"""The unpacked copy of an FMU: its library and its resources in a folder of their own."""

from __future__ import annotations

import platform
import shutil
import sys
import tempfile
import weakref
from collections.abc import Collection
from pathlib import Path

from quadvis.errors import QuadvisError
from quadvis.fmi.archive import opened, refused
from quadvis.machine.files import reason

PREFIX = "quadvis-fmu-"
_SUFFIXES = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}
_SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "windows"}
_OLD_SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "win"}  # in FMI 2.0
_PROCESSORS = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


class UnpackedFmu:
    """What of an FMU is needed to run it, in a new folder that only the user can open.

    The folder goes with `remove`, or at the latest at the end of this process, unless that is killed.
    """

    def __init__(self, path: str, version: int, identifier: str) -> None:
        self._version = version
        with opened(path) as archive:
            library = library_name(path, archive.names, version, identifier)
            try:
                self.folder = Path(tempfile.mkdtemp(prefix=PREFIX))
            except OSError as error:
                raise QuadvisError(f"cannot unpack '{path}': {reason(error)}") from error
            self._removed = weakref.finalize(self, shutil.rmtree, self.folder, True)
            try:
                archive.unpack(self.folder, [f"{library.rpartition('/')[0]}/", "resources/"])
            except BaseException:
                self.remove()
                raise
        self.library = str(self.folder / library)

    @property
    def resources(self) -> str:
        """Where the FMU finds its resources: a URI as in RFC 3986 (FMI 2.0), a path that ends in "/" (3.0).

        "" in FMI 3.0 if it has none.
        """
        place = self.folder / "resources"
        if self._version == 2:
            return place.absolute().as_uri()
        return f"{place}/" if place.is_dir() else ""

    def remove(self) -> None:
        """Remove the folder."""
        self._removed()


def _platforms(version: int) -> list[str]:
    """Return the folders in which the library for this machine may be."""
    system, processor = sys.platform, _PROCESSORS.get(platform.machine().lower(), platform.machine())
    found = [f"{processor}-{_SYSTEMS.get(system, system)}"]
    if version == 2:
        bits = 64 if sys.maxsize > 2**32 else 32
        old = [f"{_OLD_SYSTEMS.get(system, system)}{bits}"] if processor == "x86_64" else []
        found = [*old, *found]
    return found


def library_name(path: str, names: Collection[str], version: int, identifier: str) -> str:
    """Return the name of the library for this machine; QuadvisError if there is none."""
    folders = _platforms(version)
    for folder in folders:
        name = f"binaries/{folder}/{identifier}{_SUFFIXES.get(sys.platform, '.so')}"
        if name in names:
            return name
    there = sorted(
        {name.split("/")[1] for name in names if name.startswith("binaries/") and name.count("/") > 1}
    )
    others = f"it has some for {', '.join(there)}" if there else "it has none at all"
    raise refused(path, f"it has no library '{identifier}' for {folders[0]}; {others}")
