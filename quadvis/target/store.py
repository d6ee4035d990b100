"""What a target keeps on its disk: files by their SHA-256, applications, parameter sets, logs.

folder/files/<SHA-256>              contents of files, each once
folder/applications/<name>/         bundle.json, and the folder `tree` as the diagram's blocks see it
folder/sets/<name>/<set>.yaml       parameter sets of an application
folder/sets/<name>/default          the name of the one that it has when it is loaded
folder/drawings/<hash>.svg          drawings of diagrams
folder/scopes/<name>/               files of file scopes
folder/logs/<name>-<number>.mcap    the logs of its runs; of a bounded one <name>-<number>.before.mcap, too
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable, Mapping
from io import BufferedRandom
from pathlib import Path

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.machine.files import Kind, write_output
from quadvis.output.wrapped_log import BEFORE
from quadvis.target.bundle import DIGEST, NAME, ApplicationBundle, inner_path

MOST_BYTES = 256_000_000  # of a file
MOST_BUNDLE = 4_000_000
PARTLY = 8  # files that may be on their way at the same time
DRAWINGS = 20  # that are kept
DEFAULT = Kind("the name of the default parameter set")
LOGS = 100  # of one application; older ones are removed


class Store:
    """The folder of a target. One process has it at a time; see `quadvis.target.daemon`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("files", "applications", "sets", "logs", "drawings"):
            (folder / name).mkdir(mode=0o700, parents=True, exist_ok=True)
        for left in (folder / "files").glob("*.part"):
            left.unlink()
        self._partly: dict[str, BufferedRandom] = {}

    # files

    def missing(self, digests: Iterable[str]) -> list[str]:
        """Return those of some SHA-256 that are not here."""
        return [digest for digest in digests if not self._file(digest).exists()]

    def put(self, digest: str, size: int, offset: int, data: bytes) -> int:
        """Take the next piece of a file of a size; return how many bytes of it are here.

        With its last piece the contents must have their SHA-256.
        """
        path, part = self._file(digest), self._file(digest).with_suffix(".part")
        if path.exists():
            return size
        if offset == 0:
            self._drop(digest)
            if len(self._partly) >= PARTLY:
                self._drop(next(iter(self._partly)))
            self._partly[digest] = part.open("w+b")
        file = self._partly.get(digest)
        if file is None or file.tell() != offset:
            raise QuadvisError("the pieces of a file must come in their order, from the first one on")
        reached = offset + len(data)
        if max(size, reached) > MOST_BYTES or reached > size:
            self._drop(digest)
            raise QuadvisError(f"a file has its size, and at most {MOST_BYTES // 1_000_000} MB")
        file.write(data)
        if reached == size:
            file.seek(0)
            found = hashlib.file_digest(file, "sha256").hexdigest()
            if found != digest:
                self._drop(digest)
                raise QuadvisError("the contents of a file do not have the SHA-256 that was said")
            file.close()
            del self._partly[digest]
            part.replace(path)
        return reached

    def contents(self, digest: str) -> bytes:
        """Return the contents of a file; QuadvisError if it is not here, or too large to be a bundle."""
        path = self._file(digest)
        if not path.exists():
            raise QuadvisError(f"the file {quoted(digest)} is not on the target")
        if path.stat().st_size > MOST_BUNDLE:
            raise QuadvisError("this file is too large to be a bundle")
        return path.read_bytes()

    def close(self) -> None:
        """Forget the files that are not whole."""
        for digest in list(self._partly):
            self._drop(digest)

    def _drop(self, digest: str) -> None:
        file = self._partly.pop(digest, None)
        if file is not None:
            file.close()
        self._file(digest).with_suffix(".part").unlink(missing_ok=True)

    def _file(self, digest: str) -> Path:
        if not DIGEST.fullmatch(digest):
            raise QuadvisError(f"{quoted(digest)} is no SHA-256: 64 hexadecimal digits")
        return self.folder / "files" / digest

    # applications

    @property
    def applications(self) -> list[str]:
        """The names of all applications."""
        return sorted(path.parent.name for path in (self.folder / "applications").glob("*/bundle.json"))

    def add(self, bundle: ApplicationBundle) -> None:
        """Keep an application, in the place of one of the same name; its files must be here."""
        if absent := self.missing(bundle.files.values()):
            name = next(name for name, digest in bundle.files.items() if digest in absent)
            raise QuadvisError(f"the file {quoted(name)} of the application has not come")
        home = self._home(bundle.name)
        fresh = home.with_name(f".{home.name}.new")
        shutil.rmtree(fresh, ignore_errors=True)
        tree = fresh / "tree"
        (tree / inner_path(bundle.place)).parent.mkdir(parents=True)
        for name, digest in bundle.files.items():
            path = tree / inner_path(name)
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self._file(digest), path)  # a block that writes there changes no other file
        (fresh / "bundle.json").write_bytes(bundle.data)
        shutil.rmtree(home, ignore_errors=True)
        fresh.replace(home)

    def bundle(self, name: str) -> ApplicationBundle:
        """Return an application that is kept here; QuadvisError if there is none of this name."""
        path = self._home(name) / "bundle.json"
        try:
            return ApplicationBundle.parse(path.read_bytes())
        except FileNotFoundError:
            problem = f"there is no application {quoted(name)} on the target"
            raise QuadvisError(sentence(problem, suggestion(name, self.applications))) from None

    def place(self, bundle: ApplicationBundle) -> Path:
        """Return where the diagram of an application stands."""
        return self._home(bundle.name) / "tree" / bundle.place

    def remove(self, name: str) -> None:
        """Forget an application; its sets and logs stay."""
        self.bundle(name)
        shutil.rmtree(self._home(name))

    def _home(self, name: str) -> Path:
        return self.folder / "applications" / _checked(name)

    # parameter sets

    def sets(self, name: str) -> list[str]:
        """Return the names of the parameter sets of an application."""
        return sorted(path.stem for path in (self.folder / "sets" / _checked(name)).glob("*.yaml"))

    def set_path(self, name: str, chosen: str) -> Path:
        """Return the path of a parameter set."""
        folder = self.folder / "sets" / _checked(name)
        folder.mkdir(mode=0o700, exist_ok=True)
        return folder / f"{_checked(chosen, 'a parameter set')}.yaml"

    def known_set(self, name: str, chosen: str) -> Path:
        """Return the path of a parameter set; QuadvisError if there is none of this name."""
        return _known(chosen, {each: self.set_path(name, each) for each in self.sets(name)}, "parameter set")

    def drop_set(self, name: str, chosen: str) -> None:
        """Remove a parameter set; if it was the default one, there is none any more."""
        self.known_set(name, chosen).unlink()
        if self.default_set(name) == chosen:
            self.keep_default(name, "")

    def default_set(self, name: str) -> str:
        """Return the name of the set that an application has when it is loaded; "" if there is none."""
        path = self._default(name)
        return path.read_text() if path.exists() else ""

    def keep_default(self, name: str, chosen: str) -> None:
        """Note which set an application has when it is loaded, from now on; "" for none."""
        if chosen:
            self.known_set(name, chosen)
            write_output(self._default(name), DEFAULT, chosen)
        else:
            self._default(name).unlink(missing_ok=True)

    def _default(self, name: str) -> Path:
        return self.folder / "sets" / _checked(name) / "default"

    def scope_folder(self, name: str) -> Path:
        """Return the folder for the files of an application's scopes."""
        folder = self.folder / "scopes" / _checked(name)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return folder

    def drawing(self, digest: str) -> Path:
        """Return the path of the drawing of the diagram with a hash; if there are many, the oldest go."""
        kept = sorted((self.folder / "drawings").glob("*.svg"), key=_age)
        for path in kept[:-DRAWINGS]:
            path.unlink(missing_ok=True)
        return self.folder / "drawings" / f"{digest}.svg"

    # logs

    def logs(self, name: str | None = None) -> list[Path]:
        """Return the logs of an application, or all, the oldest first."""
        found = (self.folder / "logs").glob("*.mcap")
        mine = [path for path in found if name is None or _whole(path).rpartition("-")[0] == name]
        return sorted(mine, key=_age)

    def next_log(self, name: str) -> Path:
        """Return the path of the log of a new run, and remove logs of which there are too many."""
        logs = self.logs(_checked(name))
        for path in logs[: max(0, len(logs) - LOGS + 1)]:
            path.unlink(missing_ok=True)
        number = 1 + max((_number(path) for path in logs), default=0)
        return self.folder / "logs" / f"{name}-{number}.mcap"

    def known_log(self, name: str) -> Path:
        """Return the path of a log; QuadvisError if there is none of this name."""
        return _known(name, {path.stem: path for path in self.logs()}, "log")


def _checked(name: str, what: str = "an application") -> str:
    if not NAME.fullmatch(name):
        raise QuadvisError(f"{quoted(name)} is no name of {what}: use letters, digits, _ . -")
    return name


def _known(name: str, paths: Mapping[str, Path], what: str) -> Path:
    if name not in paths:
        raise QuadvisError(sentence(f"there is no {what} {quoted(name)}", suggestion(name, paths)))
    return paths[name]


def _whole(path: Path) -> str:
    """Return the name of a log, also for its part that came before the newest."""
    return path.stem.removesuffix(BEFORE)


def _number(path: Path) -> int:
    number = _whole(path).rpartition("-")[2]
    return int(number) if number.isascii() and number.isdigit() else 0


def _age(path: Path) -> tuple[float, int]:
    return os.stat(path).st_mtime, _number(path)
