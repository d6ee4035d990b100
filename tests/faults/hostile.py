"""Hostile diagrams, and a program that loads them one by one."""

from __future__ import annotations

from pathlib import Path

from tests.quadvis.test_document import HOSTILE

MOST_MEMORY = 200.0  # MB for one file
MOST_TIME = 0.5  # s for one file
# What a parser that believes in Python's tags would do; the file `run` would be there then.
RUNNING = {
    "apply": "!!python/object/apply:os.system ['touch run']",
    "new": "!!python/object/new:os.system ['touch run']",
    "call": "name: !!python/object/apply:subprocess.check_output [[touch, run]]",
}
FILES: dict[str, str | bytes] = {**HOSTILE, **RUNNING}
# A line for each file: the time of the processor (s), the most memory above that before (MB), the fault.
READER = """
import sys, time
from pathlib import Path
import quadvis
from quadvis.errors import DiagramError

def status(name):
    text = Path("/proc/self/status").read_text()
    return int(text.partition(name + ":")[2].split()[0]) / 1e3

try:
    quadvis.load(Path(sys.argv[1]).with_name("none.yaml"))  # what is imported once
except DiagramError:
    pass
for path in sys.argv[1:]:
    Path("/proc/self/clear_refs").write_text("5")
    memory, began = status("VmRSS"), time.process_time()
    try:
        quadvis.load(path)
        said = "loaded"
    except DiagramError as error:
        said = str(error).splitlines()[0]
    print(time.process_time() - began, status("VmHWM") - memory, said)
"""


def made(folder: Path) -> list[Path]:
    """Write the files, and return their paths."""
    paths = []
    for name, text in FILES.items():
        path = folder / f"{name}.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        paths.append(path)
    return paths
