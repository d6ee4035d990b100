"""A bundle: a diagram on its way to a target, as data. It holds no code and names no module.

The diagram is resolved, so it stands alone but for the files that its blocks read. Those travel by their
SHA-256. Blocks are named; the target has them installed, with the same source or it refuses the bundle.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Any

from quadvis.errors import QuadvisError, quoted

FORMAT = 1
NAME = re.compile(r"[A-Za-z0-9][\w.-]{0,63}", re.ASCII)
DIGEST = re.compile(r"[0-9a-f]{64}")
MOST_TEXT = 2_000_000  # characters of a resolved diagram, of which the largest of ours has 40,000
MOST_FILES = 10_000


@dataclass(frozen=True)
class ApplicationBundle:
    """A resolved diagram with what it needs.

    ``place`` is where its file lies in the bundle's folder, ``files`` the SHA-256 of the other files there by
    their paths, ``sources`` that of the Python file of each block by the block's name. ``ports`` and
    ``knobs`` are names that the resolved diagram has no more, as `Diagram` has them: ports of parts,
    parameters of parts. ``engine`` is one of those of `quadvis.native.choice`. ``computers`` are those
    of the diagram that the target is; none for all.
    """

    name: str
    variant: str
    text: str
    place: str
    files: Mapping[str, str]
    sources: Mapping[str, str]
    hash: str
    version: str
    ports: Mapping[str, str] = field(default_factory=dict)
    knobs: Mapping[str, Any] = field(default_factory=dict)
    engine: str = "auto"
    computers: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return it as plain data."""
        facts = {name: getattr(self, name) for name in self.__dataclass_fields__}
        maps = {name: dict(facts[name]) for name in ("files", "sources", "ports", "knobs")}
        return {"format": FORMAT, **facts, **maps}

    @property
    def data(self) -> bytes:
        """The bundle as a file: JSON."""
        return json.dumps(self.plain(), sort_keys=True).encode()

    @staticmethod
    def parse(data: bytes) -> ApplicationBundle:
        """Read a bundle's file of unknown origin; QuadvisError if anything is not as it must be."""
        try:
            plain = json.loads(data)
        except (ValueError, RecursionError):
            plain = None
        if not isinstance(plain, dict):
            raise QuadvisError("this file is no bundle")
        return ApplicationBundle.read(plain)

    @staticmethod
    def read(plain: Mapping[str, Any]) -> ApplicationBundle:
        """Read it from plain data of unknown origin; QuadvisError if anything is not as it must be."""
        if plain.get("format") != FORMAT:
            raise QuadvisError(
                f"this is no bundle of format {FORMAT}: use the same quadvis on host and target"
            )
        given = {name: plain.get(name) for name in ApplicationBundle.__dataclass_fields__}
        texts = ("name", "variant", "text", "place", "hash", "version", "engine")
        for name in texts:
            if not isinstance(given[name], str):
                raise QuadvisError(f"the bundle's {name!r} must be a text")
        for name in ("files", "sources"):
            if not _is_digests(given[name]):
                raise QuadvisError(f"the bundle's {name!r} must be SHA-256 by name, at most {MOST_FILES}")
        for name in ("ports", "knobs"):
            if not isinstance(given[name], dict):
                raise QuadvisError(f"the bundle's {name!r} must be a map")
        computers = given["computers"]
        if not isinstance(computers, list | tuple) or not all(isinstance(each, str) for each in computers):
            raise QuadvisError("the bundle's 'computers' must be a list of texts")
        given["computers"] = tuple(computers)
        made = ApplicationBundle(**given)  # type: ignore[arg-type]
        if not NAME.fullmatch(made.name):
            raise QuadvisError(
                f"{quoted(made.name)} is no name of an application: use letters, digits, _ . -"
            )
        if len(made.text) > MOST_TEXT:
            raise QuadvisError(f"the diagram has more than {MOST_TEXT} characters")
        for path in (made.place, *made.files):
            inner_path(path)
        return made


def inner_path(text: str) -> PurePosixPath:
    """Return a path that stays inside the folder to which it is relative; QuadvisError if it does not."""
    path = PurePosixPath(text)
    odd = not text or "\0" in text or "\\" in text or len(text) > 1000 or text != path.as_posix()
    if odd or path.is_absolute() or ".." in path.parts or path.parts == ():
        raise QuadvisError(f"the path {quoted(text)} leaves the folder of the application")
    return path


def _is_digests(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and len(value) <= MOST_FILES
        and all(
            isinstance(name, str) and isinstance(digest, str) and DIGEST.fullmatch(digest)
            for name, digest in value.items()
        )
    )
