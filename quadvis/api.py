"""The roof: what `import quadvis` gives of diagrams, with methods that run, judge, analyse and draw them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from quadvis.diagram import load as loading
from quadvis.diagram.diagram import Diagram as Checked
from quadvis.diagram.settings import Files, Given
from quadvis.errors import counted
from quadvis.library.catalogue import OwnBlocks

if TYPE_CHECKING:
    from quadvis.analysis.analyse import Analysis
    from quadvis.export.fmu import ExportedFmu
    from quadvis.output.recording import Recorded
    from quadvis.realtime.options import RealTime
    from quadvis.run.accuracy import Accuracy
    from quadvis.run.live import LiveRun
    from quadvis.run.loops import Progress
    from quadvis.run.result import Result
    from quadvis.run.verdict import Outcome

# What a method needs it imports when it is called: a diagram that is only looked at costs no engine.


class Diagram(Checked):
    """A diagram without a fault, with what can be done with it. A notebook shows it as its picture."""

    def __repr__(self) -> str:
        variant = f" ({self.variant})" if self.variant else ""
        return f"<Diagram {self.name}{variant}: {counted(len(self.listing), 'block')}>"

    def _repr_svg_(self) -> str:
        return self.draw(depth=1)

    def run(
        self,
        *,
        log: str | Path | None = None,
        progress: Progress | None = None,
        keep: Sequence[str] | None = None,
        engine: str = "auto",
        announce: Callable[[str], None] | None = None,
        real_time: RealTime | None = None,
        profile: bool = False,
    ) -> Result:
        """Run to the stop time; see ``quadvis.run.session.run``."""
        from quadvis.run.session import run

        return run(
            self,
            log=log,
            progress=progress,
            keep=keep,
            engine=engine,
            announce=announce,
            real_time=real_time,
            profile=profile,
        )

    def start(self, log: str | Path | None = None) -> LiveRun:
        """Return a run to be advanced step by step; see ``quadvis.run.live.LiveRun``."""
        from quadvis.run.live import LiveRun

        return LiveRun(self, log=log)

    def judge(self, signals: Recorded) -> Outcome:
        """Return the summary and the verdicts of a recorded run; it may have ended early."""
        from quadvis.run.verdict import Judging

        judging = Judging(self.summary, self.expectations)
        judging.read(signals)
        return judging.outcome()

    def accuracy(self, *, engine: str = "auto") -> Accuracy:
        """Run it with smaller steps, and say what these change; see ``quadvis.run.accuracy.accuracy``."""
        from quadvis.run.accuracy import accuracy

        return accuracy(self, engine=engine)

    def analyse(
        self,
        *,
        cuts: Mapping[str, str | Sequence[str]] = MappingProxyType({}),
        limits: Mapping[str, tuple[str, str, str]] = MappingProxyType({}),
        transfers: Mapping[str, Sequence[str]] = MappingProxyType({}),
        at: float | None = None,
        engine: str = "auto",
    ) -> Analysis:
        """Linearise the closed loop at its operating point; see ``quadvis.analysis.analyse.analyse``."""
        from quadvis.analysis.analyse import analyse

        return analyse(self, cuts, limits, at, engine, transfers)

    def varied(self, setting: str) -> Diagram:
        """Return the diagram, loaded again with one more parameter replaced: ``block.parameter=value``."""
        return _with_methods(loading.varied(self, setting))

    def export_fmu(self, name: str, path: str | Path, *, version: int = 2) -> ExportedFmu:
        """Write a part, a block, or "." for all of it, as an FMU; see ``quadvis.export.fmu.export_fmu``."""
        from quadvis.export.fmu import export_fmu

        return export_fmu(self, name, path, version=version)

    def draw(self, *, part: str = "", depth: int | None = None) -> str:
        """Return a picture of the diagram, or of a part, as SVG; with ``depth`` deeper parts are one box."""
        from quadvis.diagram.picture import draw_diagram

        return draw_diagram(self, part=part, depth=depth)


def _with_methods(diagram: Checked) -> Diagram:
    return Diagram(**{field.name: getattr(diagram, field.name) for field in fields(diagram)})


def load(
    path: str | Path,
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    stop_time: str | float | None = None,
    seed: int | None = None,
    own_blocks: OwnBlocks = True,
) -> Diagram:
    """Load and check a diagram; see ``quadvis.diagram.load.load``."""
    return _with_methods(
        loading.load(
            path, variant=variant, settings=settings, params=params, stop_time=stop_time, seed=seed,
            own_blocks=own_blocks,
        )
    )  # fmt: skip


def load_text(
    text: str, folder: str | Path = ".", name: str = "diagram.yaml", own_blocks: OwnBlocks = True
) -> Diagram:
    """Load a diagram from a text, such as that in a log; see ``quadvis.diagram.load.load_text``."""
    return _with_methods(loading.load_text(text, folder, name, own_blocks))


def check(
    path: str | Path, settings: Given = (), params: Files = (), own_blocks: OwnBlocks = True
) -> Diagram:
    """Load a diagram, and with each of its variants in turn; see ``quadvis.diagram.load.check``."""
    return _with_methods(loading.check(path, settings, params, own_blocks))
