"""The systemd unit of a target: it starts at boot, is watched, and may use real-time priorities."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from quadvis.errors import QuadvisError
from quadvis.machine.files import Kind, write_output
from quadvis.wire.keys import checked_name

FOLDER = Path("/etc/systemd/system")
UNIT = Kind("the systemd unit", (b"[Unit]",), rb"^ExecStart=")
WATCHDOG = 10  # s


def unit_text(
    name: str,
    *,
    listen: str | None = None,
    folder: str | None = None,
    startup: str | None = None,
    cpu: str | None = None,
) -> str:
    """Return the unit of a target with this name; ``cpu`` is as in "1" or "1,2".

    The limits let the loops have SCHED_FIFO and lock their memory without further rights. systemd starts the
    target again if it ends or hangs.
    """
    command = [sys.executable, "-m", "quadvis", "target", "--name", checked_name(name)]
    if listen:
        command += ["--listen", listen]
    if folder:
        command += ["--folder", str(Path(folder).absolute())]
    if startup:
        command += ["--startup", startup]
    lines = [
        "[Unit]",
        f"Description=quadvis target {name}",
        "Wants=network-online.target" if listen else "",
        "After=network-online.target" if listen else "",
        "",
        "[Service]",
        "Type=notify",
        "NotifyAccess=main",
        f"ExecStart={_line(command)}",
        "Restart=on-failure",
        f"WatchdogSec={WATCHDOG}",
        "KillMode=control-group",  # "mixed" kills the guardian at once when the target has died
        "SuccessExitStatus=143",  # what `quadvis target` ends with when it is stopped
        "TimeoutStopSec=10",
        "OOMPolicy=continue",  # it may have been the porter, which the target starts again
        "LimitRTPRIO=99",
        "LimitMEMLOCK=infinity",
        f"CPUAffinity={_processors(cpu)}" if cpu else "",
        f"StateDirectory=quadvis/{name}",
        f"RuntimeDirectory=quadvis/{name}",
        "RuntimeDirectoryMode=0700",
        "StateDirectoryMode=0700",
        "",
        "[Install]",
        "WantedBy=multi-user.target",
    ]
    kept = [line for number, line in enumerate(lines) if line or (number and lines[number - 1])]
    return "\n".join(kept) + "\n"


def _line(command: list[str]) -> str:
    """Return a command as systemd reads it, to which % and $ mean something in quotes, too."""
    return shlex.join(command).replace("%", "%%").replace("$", "$$")


def write_unit(text: str, name: str, path: str | None) -> str:
    """Write a unit, by default where systemd looks for it; return a sentence on what to do next."""
    place = Path(path) if path else FOLDER / f"quadvis-{name}.service"
    write_output(place, UNIT, text)
    if path:
        return str(place)
    return f"{place}\nrun: systemctl daemon-reload && systemctl enable --now {place.name}"


def _processors(text: str) -> str:
    numbers = [each.strip() for each in text.split(",")]
    if not all(each.isascii() and each.isdigit() for each in numbers):
        raise QuadvisError("--cpu must be numbers of processors, such as 1 or 1,2")
    return " ".join(numbers)
