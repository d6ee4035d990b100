"""`quadvis plot`: which figures of which logs, and where they go."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.diagram.sections.figures import FIGURES, read_figures
from quadvis.document import YamlMap, read_yaml
from quadvis.errors import Faults, QuadvisError
from quadvis.graph.names import split_names, wire_text
from quadvis.output.figures import Figure, Trace, signal_figure, with_signals
from quadvis.output.log_reader import Log, read_log
from quadvis.output.plot import plot_logs, plot_times

if TYPE_CHECKING:
    from quadvis.library.catalogue import OwnBlocks


def plot(options: argparse.Namespace, own_blocks: OwnBlocks) -> int:
    """Draw figures of logs, and print the names of the files."""
    logs = [read_log(path) for path in options.logs]
    for log in logs:
        if log.damage:
            print(log.damage, file=sys.stderr)
    output = Path(options.output) if options.output else None
    if options.times:
        if len(logs) > 1:
            raise QuadvisError("--times takes one log; draw them one by one")
        paths = plot_times(logs[0], output)
    else:
        paths = plot_logs(logs, _figures(options, logs, own_blocks), output)
    for path in paths:
        print(path)
    if options.show:
        _show(paths)
    return 0


def _figures(options: argparse.Namespace, logs: Sequence[Log], own_blocks: OwnBlocks) -> list[Figure]:
    """Return the figures that are asked for; [] means one for each block."""
    log = logs[0]
    if options.signals:
        traces = [_trace(log, name) for text in options.signals for name in split_names(text) if name]
        against = _trace(log, options.against) if options.against else None
        return [signal_figure(traces, log.units, against)]
    if options.against:
        raise QuadvisError("--against says what lies across; add what goes up, with --signals")
    if options.figures:
        return _figures_of(Path(options.figures), log, own_blocks)
    return read_figures(log.diagram, f"{log.path}: diagram")


def _trace(log: Log, name: str) -> Trace:
    return Trace(log.wire(name), name)


def _figures_of(path: Path, log: Log, own_blocks: OwnBlocks) -> list[Figure]:
    """Return the figures of a diagram, in the variant of the log, or of a file that has nothing else."""
    faults = Faults()
    root = read_yaml(path, faults)
    faults.check()
    if isinstance(root, YamlMap) and "quadvis" in root:
        from quadvis.diagram.load import load

        diagram = load(path, variant=log.metadata.get("variant") or None, own_blocks=own_blocks)
        found = list(diagram.values[FIGURES].items)
    else:
        read = read_figures(path.read_text(encoding="utf-8"), str(path))
        found = [
            each._replace(
                panels=tuple(
                    with_signals(panel, lambda wire: log.wire(wire_text(wire))) for panel in each.panels
                )
            )
            for each in read
        ]
    if not found:
        raise QuadvisError(f"'{path}' has no figures; write them under 'figures'")
    return found


def _show(paths: Sequence[Path]) -> None:
    """Open the files in what the system shows them with."""
    import webbrowser

    for path in paths:
        if not webbrowser.open(path.resolve().as_uri()):
            raise QuadvisError(f"nothing here can show '{path}'; copy it to where you have a screen")
