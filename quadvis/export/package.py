"""Sources compiled for this machine, and all of it packed as an archive that is the same at every export."""

from __future__ import annotations

import io
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.files import Kind

COMPILERS = ("cc", "gcc", "clang")
OPTIONS = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden")
HEADERS = {
    2: ("fmi2TypesPlatform.h", "fmi2FunctionTypes.h", "fmi2Functions.h"),
    3: ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h"),
}
FMU = Kind("the FMU", (b"PK\x03\x04",), rb"modelDescription\.xml")
_EPOCH = (1980, 1, 1, 0, 0, 0)


def fmi_headers(version: int) -> dict[str, str]:
    """Return the headers of FMI, which come with fmpy; QuadvisError if it is not installed."""
    spec = find_spec("fmpy")
    homes = (spec.submodule_search_locations or ()) if spec else ()
    for home in homes:
        folder = Path(home) / "c-code"
        if folder.is_dir():
            return {name: (folder / name).read_text(encoding="utf-8") for name in HEADERS[version]}
    raise QuadvisError("the headers of FMI come with the package fmpy, which is not installed")


def compiled(sources: Mapping[str, str], files: tuple[str, ...], name: str) -> bytes:
    """Return the shared library of C sources; QuadvisError if there is no compiler, or it refuses them."""
    compiler = next(filter(None, map(shutil.which, filter(None, (os.environ.get("CC"), *COMPILERS)))), None)
    if compiler is None:
        raise QuadvisError("an FMU is compiled by a C compiler, and there is none; install gcc or clang")
    with tempfile.TemporaryDirectory(prefix="quadvis-export-") as folder:
        for each, text in sources.items():
            Path(folder, each).write_text(text, encoding="utf-8")
        made = Path(folder, name)
        command = [compiler, *OPTIONS, *files, "-o", str(made), "-lm"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        except OSError as error:
            raise QuadvisError(f"the C compiler cannot be run: {error.strerror}") from error
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line] or [
                f"code {done.returncode}"
            ]
            raise QuadvisError(f"the C compiler refuses the sources: {quoted(lines[0], 200)}")
        return made.read_bytes()


def platform_folder(version: int) -> str:
    """Return the folder of binaries for this machine; QuadvisError if FMI has none."""
    systems = {"linux": "linux", "darwin": "darwin"}
    processors = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
    system, processor = systems.get(sys.platform), processors.get(platform.machine().lower())
    if system is None or processor is None:
        raise QuadvisError(
            f"FMUs are not made on {sys.platform} for {platform.machine()}; Linux and macOS are known"
        )
    return f"{system}64" if version == 2 and processor == "x86_64" else f"{processor}-{system}"


def library_suffix() -> str:
    """Return the end of the names of shared libraries."""
    return ".dylib" if sys.platform == "darwin" else ".so"


def packed(files: Mapping[str, str | bytes]) -> bytes:
    """Return an archive of files; the same files give the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name, _EPOCH)
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, data)
    return buffer.getvalue()
