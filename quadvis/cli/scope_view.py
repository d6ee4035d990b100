"""What `quadvis scope` shows and writes: samples of a target's signals."""

from __future__ import annotations

import csv
import io
import shutil
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.machine.files import PNG, Kind, check_output, write_output
from quadvis.scopes.package import Package

if TYPE_CHECKING:
    from quadvis.host.target import Target

CSV = Kind("the table", (b"time [s],",))
KINDS = {".csv": CSV, ".png": PNG}  # by the end of the file's name
LIVE = 0.1  # s between two pictures
HEIGHT = 16  # lines of a picture


def acquire(tg: Target, signals: Sequence[str], settings: Mapping[str, Any], timeout: float) -> Package:
    """Return one package of a scope that is added for it and removed again."""
    scope = tg.addscope("host", signals=signals, **settings)
    try:
        scope.start()
        _say_if_nothing_runs(tg, f"waiting {timeout:g} s for one")
        for package in scope.packages(timeout):
            return package
        raise QuadvisError(_why(tg, scope.facts(), timeout))
    finally:
        scope.remove()


def _say_if_nothing_runs(tg: Target, words: str) -> None:
    if tg.status()["Status"] != "running":
        print(f"{tg.name} runs no application: {words}", file=sys.stderr, flush=True)


def _why(tg: Target, facts: Mapping[str, Any], timeout: float) -> str:
    """Return why nothing has come."""
    if tg.status()["Status"] != "running":
        return f"{tg.name} runs no application: start it first"
    return f"the scope is {facts['Status'].lower()} after {timeout:g} s, and no samples have come"


def live(tg: Target, signals: Sequence[str], settings: Mapping[str, Any]) -> None:
    """Show the newest samples until Ctrl-C."""
    count = settings["NumSamples"]
    piece = max(1, min(count, count // 20))
    scope = tg.addscope("host", signals=signals, **{**settings, "NumSamples": piece})
    kept: list[Package] = []
    drawn = 0.0
    try:
        scope.start()
        _say_if_nothing_runs(tg, "waiting for one, until Ctrl-C")
        for package in scope.packages(1e9):
            kept.append(package)
            while sum(len(each.times) for each in kept) - len(kept[0].times) >= count:
                kept.pop(0)
            if time.monotonic() - drawn >= LIVE:
                drawn = time.monotonic()
                text = shown(_joined(kept))
                sys.stdout.write(f"\x1b[H\x1b[2J{text}\n" if sys.stdout.isatty() else f"{text}\n\n")
                sys.stdout.flush()
    except KeyboardInterrupt:
        pass
    finally:
        scope.remove()


def shown(samples: Package) -> str:
    """Return samples as a picture of text that fits the terminal."""
    from quadvis.machine.status_line import shows_colours
    from quadvis.scopes.panel import panel

    width, lines = shutil.get_terminal_size((100, 24))
    return panel(samples, width, min(HEIGHT, lines - 3), colours=shows_colours(sys.stdout))


def check_place(path: Path) -> None:
    """Raise QuadvisError if samples cannot be written there: before they are waited for."""
    if path.suffix not in KINDS:
        raise QuadvisError(f"cannot write samples as '{path}': give a name that ends in .csv or .png")
    check_output(path, KINDS[path.suffix])


def written(samples: Package, path: Path) -> str:
    """Write samples as a table, .csv, or as a picture, .png; return the path."""
    check_place(path)
    if path.suffix == ".csv":
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        units = [name if unit == "1" else f"{name} [{unit}]" for name, unit in _named(samples)]
        rows.writerow(["time [s]", *units])
        rows.writerows(np.column_stack((samples.times, samples.samples)).tolist())
        write_output(path, CSV, text.getvalue())
    else:
        _picture(samples, path)
    return str(path)


def _picture(samples: Package, path: Path) -> None:
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 4.5), layout="constrained")
    for column, (name, unit) in enumerate(_named(samples)):
        axes.plot(
            samples.times, samples.samples[:, column], label=name if unit == "1" else f"{name} [{unit}]"
        )
    if samples.trigger is not None and 0 <= samples.trigger < len(samples.times):
        axes.axvline(samples.times[samples.trigger], color="0.6", linewidth=0.8)
    axes.set_xlabel("time [s]")
    axes.legend(loc="best", frameon=False)
    axes.grid(alpha=0.3)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=120)
    pyplot.close(figure)
    write_output(path, PNG, picture.getvalue())


def _named(samples: Package) -> list[tuple[str, str]]:
    return list(zip(samples.names, samples.units, strict=True))


def _joined(kept: Sequence[Package]) -> Package:
    """Return packages that follow one another as one."""
    return replace(
        kept[-1],
        ticks=np.concatenate([each.ticks for each in kept]),
        times=np.concatenate([each.times for each in kept]),
        samples=np.concatenate([each.samples for each in kept]),
    )
