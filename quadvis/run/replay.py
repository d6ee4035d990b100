"""Replay: a run repeated from what its log holds, and compared with it row by row."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.diagram.load import load_text
from quadvis.engine.engine import Engine
from quadvis.engine.tuning import Change, NewValue
from quadvis.errors import DiagramError, QuadvisError, RunError
from quadvis.errors.caller import as_given
from quadvis.machine.files import reading
from quadvis.native.choice import AUTO, Announce, Choice, choose, use
from quadvis.output.log_reader import Log, read_log
from quadvis.run.loops import REAL_TIME, Progress, Takers, advance, paced_taps
from quadvis.run.outside import outside
from quadvis.run.playback import RecordedClock, with_playback
from quadvis.run.played_files import check_played_files
from quadvis.run.played_tasks import PlayedTasks
from quadvis.run.recorded_run import COMPUTERS, RecordedPart, RecordedRun
from quadvis.run.row_comparison import FoundDifference, Lack, RowComparison
from quadvis.run.rows import signals_of
from quadvis.run.session import recorded

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.diagram.settings import Given
    from quadvis.library.catalogue import OwnBlocks

LOGGED = "diagram.yaml"  # as which the diagram in a log is loaded


@dataclass(frozen=True)
class Replay:
    """A run that was repeated; ``whole`` is true if its log has it up to its stop time.

    ``ticks`` is the number of those that ran again, ``left_out`` of those that the run had left out, and the
    last one was at ``time`` (s). The outputs of the blocks ``played`` came from the log, and those that are
    ``idle`` only write, which a replay does not. ``signals`` and ``rows`` were compared; ``differences`` are
    in the order of their ticks. ``lacks`` are rows that only the log has, or only the replay; a log that is
    not whole may lack rows. ``output`` is the new log, ``lost`` what the disk refused of it.
    """

    log: Log
    diagram: Diagram
    clock: str
    whole: bool
    ticks: int
    left_out: int
    time: float
    played: tuple[str, ...]
    idle: tuple[str, ...]
    signals: int
    rows: int
    differences: tuple[FoundDifference, ...]
    lacks: tuple[Lack, ...]
    engine: Choice
    output: Path | None = None
    lost: str = ""

    @property
    def same(self) -> bool:
        """True if all rows are the same to the bit."""
        return not self.differences and not self.lacks


def replay(
    log: Log | str | Path,
    *,
    settings: Given = (),
    output: str | Path | None = None,
    folder: str | Path | None = None,
    engine: str = AUTO,
    progress: Progress | None = None,
    announce: Announce | None = None,
    own_blocks: OwnBlocks = True,
) -> Replay:
    """Repeat the run of a log and compare all rows; QuadvisError if the log does not hold what is needed.

    ``settings`` replace parameters of blocks, as in ``quadvis.load``; what came from outside stays as it was.
    ``output`` is the path of a new log. ``folder`` is that of the diagram; by default the log says it.
    No block that reaches outside is opened, and nothing is written but the new log.
    """
    log = log if isinstance(log, Log) else read_log(log)
    if not log.diagram:
        raise QuadvisError(f"the log '{log.path}' holds no diagram, so nothing can be run again")
    diagram = _loaded(log, folder, own_blocks, settings)
    check_played_files(diagram, log.files)
    run = RecordedRun(log, diagram)
    comparisons = [
        RowComparison(log, part, each, run.ticks)
        for part in run.parts
        for each in signals_of(diagram)
        if each.node.path in part.graph and each.node.path not in part.played
    ]
    loop = _Repeated(run, diagram, engine, announce)
    new = None if output is None else Path(output)
    with reading([log.path]):
        result = recorded(
            diagram, loop, log=new, keep=(), taps=comparisons, facts={"replay of": str(log.path)},
            progress=progress,
        )  # fmt: skip
    away = [node for part in run.parts for node in outside(part.graph)]
    found = [each for comparison in comparisons for each in comparison.found()]
    left_out = sum(part.missed(run.ticks) for part in run.parts)
    return Replay(
        log=log,
        diagram=diagram,
        clock=run.clock,
        whole=run.whole,
        ticks=run.ticks * len(run.parts) - left_out,
        left_out=left_out,
        time=run.end,
        played=tuple(node.path for node in away if node.block.interface.outputs),
        idle=tuple(node.path for node in away if not node.block.interface.outputs),
        signals=sum(len(comparison.ports) for comparison in comparisons),
        rows=sum(comparison.rows for comparison in comparisons),
        differences=tuple(sorted(found, key=lambda each: each.tick)),
        lacks=tuple(lack for each in comparisons for lack in each.lacks()) if run.whole else (),
        engine=result.engine,
        output=new,
        lost=result.lost,
    )


def _loaded(log: Log, folder: str | Path | None, own_blocks: OwnBlocks, settings: Given) -> Diagram:
    """Return the diagram of a log; DiagramError says which of its files is missing or is another one."""
    where = log.metadata.get("folder", ".") if folder is None else folder
    try:
        here = tuple(filter(None, log.metadata.get(COMPUTERS, "").split(", ")))
        return replace(load_text(log.diagram, where, LOGGED, own_blocks, settings), here=here)
    except DiagramError as error:
        inside = str(Path(where) / LOGGED)
        mine = [fault.place.file == inside for fault in error.faults]
        found = DiagramError(
            replace(fault, place=replace(fault.place, file=f"{log.path}: diagram")) if own else fault
            for fault, own in zip(error.faults, mine, strict=True)
        )
        given = as_given("--set", "settings")
        if folder is None and any(fault.place.file != given for fault in error.faults):
            option = as_given("--folder", "folder")
            found.add_note(f"the log says that its diagram stood in '{where}'; {option} names another folder")
        raise found from None


class _Repeated:
    """The loop of a replay: the graphs of all computers, at the ticks that a log has."""

    def __init__(self, run: RecordedRun, diagram: Diagram, engine: str, announce: Announce | None) -> None:
        self.clock, self._run, self._diagram = run.clock, run, diagram
        self.graphs = [part.graph for part in run.parts]
        self.early = "" if run.whole else "the log that was replayed goes no further"
        paced = run.parts if run.clock == REAL_TIME else []
        self.computers, self.measured = {part.computer: part.graph for part in paced}, False
        self._engines = [self._engine(part) for part in run.parts]
        self._choice, *_ = choices = [choose(made, run.ticks, engine, announce) for made in self._engines]
        for part, made, choice in zip(run.parts, self._engines, choices, strict=True):
            if len(part.releases) or (part.dispatched and len(part.left_out)):
                _play_tasks(part, made, choice, run.ticks)
            else:
                use(made, choice)

    def _engine(self, part: RecordedPart) -> Engine:
        """Return the engine of a computer."""
        graph = with_playback(part.graph, part.inputs(self._run.ticks))
        made = Engine(graph, self._diagram.seed)
        made.end_before(self._run.ticks)

        def tune(changes: Sequence[Change]) -> None:
            made.tuning.set_all([NewValue(*change[1:]) for change in changes])

        made.clock = RecordedClock(part.left_out, part.changes(), tune)
        return made

    def run(self, takers: Takers, stack: ExitStack) -> tuple[Choice, None]:
        """Run up to where the log ends."""
        paced = paced_taps(takers.taken, self._diagram)
        for part, engine in zip(self._run.parts, self._engines, strict=True):
            for tap in (*paced, *takers.taps):
                if tap.block in part.graph:
                    engine.attach(tap)
            if part.computer in self.computers:
                takers.notes.left_out(part.computer, part.left_out)
                takers.notes.releases(part.computer, part.releases)
            engine.tuning.noted = takers.changed
            stack.enter_context(engine)
        try:
            advance(self._engines, self._run.ticks, takers.tend)
        except RunError as error:
            if self._run.whole or error.time != self._run.end:
                raise  # else it is how the recorded run has ended, too
        for each in paced:
            each.end(self._run.ticks)
        return self._choice, None


def _play_tasks(part: RecordedPart, engine: Engine, choice: Choice, end: int) -> None:
    """Let the tasks of an engine begin at the ticks at which they did in a run."""
    begun = [part.begun(task, end) for task in part.graph.tasks[1:]]
    engine.run_with(lambda interpreter: PlayedTasks(interpreter, choice, begun))
