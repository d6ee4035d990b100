"""The pages and pictures on their way to the generator: files that did not change keep their times."""

from __future__ import annotations

from pathlib import Path


class Staging:
    """A folder of pages; what a build did not write is removed at its end, so that no old page stays."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._written: set[Path] = set()

    def write(self, name: str, content: str | bytes) -> None:
        """Write a file, by its path in the folder, unless it has this content already."""
        path = self.folder / name
        data = content.encode() if isinstance(content, str) else content
        self._written.add(path)
        if path.is_file() and path.read_bytes() == data:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)

    def pages(self) -> list[str]:
        """Return the names of all pages that were written, without their suffix."""
        named = (path.relative_to(self.folder) for path in self._written if path.suffix == ".md")
        return sorted(name.with_suffix("").as_posix() for name in named)

    def clear(self) -> None:
        """Remove the files of earlier builds."""
        for path in self.folder.rglob("*"):
            if path.is_file() and path not in self._written:
                path.unlink()
