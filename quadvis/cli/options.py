"""The commands and options of `quadvis`."""

from __future__ import annotations

import argparse
import functools
from typing import Any

from quadvis.cli import diagram_commands, library_commands, run_commands, wire
from quadvis.cli.arguments import Parser
from quadvis.cli.target_options import add_target_commands
from quadvis.cli.tool import dimensions, positive
from quadvis.version import __version__

JSON_HELP = """\
--json prints one object: diagram, variant, params, hash, seed, passed, duration_s, wall_s, cpu_s,
engine, real_time_factor, log, lost (what the log lacks, and why);
real_time (null for a simulation): {lost_rows, computers: [{computer (null if the diagram names none), engine,
granted, not_granted, unsafe (why its outputs were made safe, or null),
tasks: {name: {period_s, steps, overruns,
lateness and execution: {min_s, mean_s, max_s, p99_s, p99.9_s, histogram: [{from_s, to_s, count}]}}}}]};
summary: {label: {signal, unit, and the statistics by name, final of a vector as a list}};
expect: [{expectation, signal, kind, unit, limit, found, met, lack (why the run cannot be judged), shown
(what was found, as text)}];
margins: the number of expectations that only 'quadvis analyse' judges;
warnings: [{file, line, column, subject, problem, remedy}], about what runs but is surely a mistake.
Numbers are in the unit beside them, null for a number that is unknown or infinite.
Exit code: 0 all expectations met, 1 an expectation is not met, the run stopped or its log lacks something,
2 bad input; 130, 129 or 143 interrupted, hung up or ended."""

CHECK_HELP = """\
--json prints one object: ok, faults or warnings: [{file, line, column, subject, problem, remedy}]; without a
fault also diagram, blocks, hash, links and ages; with --accuracy also accuracy: {solver, step_s, converged,
verdict, remarks, too_large (null, or {block, pole: [real, imaginary] in 1/s, stable_to_s}),
signals: [{signal, unit, difference, time, share (of the range of the signal), order}]}, the largest share
first.
Exit code: 0 no fault, 1 the step is not stable or half of it changes a signal by more than 1 % of its range,
2 a fault."""

REPLAY_HELP = """\
The diagram, the seed, the ticks, and what came from outside are those of the log; the diagram's files must be
what they were. No device is opened, and nothing is written but the new log.
--json prints one object: log, diagram, hash, seed, set, clock, whole (the log has the run up to its stop
time), damage, ticks, left_out, end_s, from_log and not_run (blocks), signals, rows (compared), same,
differences: [{signal, unit, element, values, largest, rows, different_rows, tick, time_s}], in the order of
the first tick that differs, for which element and values are given, as in the log and in the replay;
lacks: [{block, rows, time_s, only_in}], engine, new_log, lost (what the new log lacks, and why). Numbers are
null where they are infinite or NaN.
Exit code: 0 the same to the bit, or with --set; 1 something differs, or a block fails; 2 the log does not
hold what is needed, or bad input."""

CAMERA_HELP = """\
A picture is shown on the terminal, in colour if COLORTERM says truecolor, else in dots. For --calibrate move
the board before the camera, hold it still for a moment in each place, and tilt it by 20 degrees and more each
way; what is missing is said in words. Ctrl-C ends the sitting and calibrates with the views that there are.
Exit code: 0 done, 2 no such camera, no pictures, or views that do not determine a camera."""

SWEEP_HELP = """\
With several --over all combinations are run; the last one changes fastest. A name is that of a parameter, as
for --set, or seed, variant, params (files); 'none' means no variant or no file. A range is 0..29, or
with a step 1..3 step 0.5 rad/s. The table has the axes, the numbers of summary and expectations with their
units, passed, failure (why a run stopped) and the hash of the diagram; it does not depend on the number of
processes. Wall times do, so it has them only with --timings.

A --design is another choice of runs than all combinations: --runs of a latin_hypercube, a sobol sequence,
at random, or by saltelli's scheme (for --sensitivity); or one_at_a_time, others as in the diagram. An axis is
then also a range of any value, '1..4 rad/s', or a distribution, 'normal(0.5 kg, 20 g)': uniform(LOW, HIGH),
loguniform(LOW, HIGH), normal(MEAN, DEVIATION), truncated_normal(MEAN, DEVIATION, LOW, HIGH),
lognormal(MEDIAN, FACTOR), triangular(LOW, MODE, HIGH). Listed values are drawn alike often. The summary has
means with their 95 % interval (bootstrap), quantiles, and the probability to fail with Wilson's interval:
  quadvis sweep diagrams/motor.yaml --over kp='0.2..0.8 V*s/rad' --over J='normal(0.01, 0.002)' \\
    --design latin_hypercube --runs 200 --until 'failing within 5 %'

Exit code: 0 all runs passed, 1 a run did not, 2 bad input; 130, 129 or 143 interrupted, hung up or ended
(finished runs are in the table)."""

DIFF_HELP = """\
A and B are diagrams or logs. Diagrams are compared as they run: parts expanded, every parameter given. Two
logs are compared signal by signal as well, at the times that both have.
--json prints one object: old, new, same, facts (of the runs), sections: {key: [{name, kind, old, new}]},
blocks: [{block, kind, old, new (their classes), changes: [{name, kind, old, new}]}], same_blocks;
signals (null unless both are logs): {compared, different: [{signal, unit, element, values, largest, rows,
different_rows, time_s}], only_old, only_new, unlike: [{signal, what}]}. A kind is added, removed or changed.
Exit code: 0 the same, 1 different, 2 bad input."""

MERGE_HELP = """\
Three lines make git use it for the diagrams of a repository, and show changes by block and key:
  echo '*.yaml diff=quadvis merge=quadvis' >> .gitattributes
  git config diff.quadvis.textconv 'quadvis diff --git'
  git config merge.quadvis.driver 'quadvis merge %O %A %B'
Both versions of what both have changed stand between marks, as git has them, and are said in words.
Exit code: 0 merged, 1 with conflicts, 2 a file that cannot be read."""

FMT_HELP = """\
Keys get the order of the reference, levels are indented by two blanks, and a map in brackets that is too long
for its line gets a line for each key. Comments, the order of blocks, and the kind of each list and map stay.
The result is read again before it is written: a file whose meaning would change is refused.
Exit code: 0 done, 1 with --check if a file is not in the style, 2 bad input."""

SHELL_HELP = """\
examples:
  quadvis completion bash > ~/.local/share/bash-completion/completions/quadvis
  quadvis completion zsh > ~/.zfunc/_quadvis  # with 'fpath+=~/.zfunc' before compinit in ~/.zshrc
  quadvis completion fish > ~/.config/fish/completions/quadvis.fish"""

TUNE_HELP = """\
examples:
  quadvis tune diagrams/hover.yaml --variant geometric --minimise xy.rms --over bandwidth='1..6 rad/s'
  quadvis tune motor.yaml --minimise error.rms --over kp=1..20 --over ki='0.1..10 1/s' -o best.yaml

Each trial is a run, or one for each seed. The parameters' own values are tried first; then scipy's optimisers
search in the ranges, by methods that need no derivative.
Exit code: 0 the best trial meets all expectations, 1 it does not, 2 bad input."""

PLOT_HELP = """\
examples:
  quadvis plot runs/hover.mcap
  quadvis plot runs/hover.mcap --signals craft.position,estimate.position -o position.svg
  quadvis plot runs/hover.mcap --signals 'craft.position[1]' --against 'craft.position[0]'
  quadvis plot runs/hover.mcap runs/hover-robust.mcap --figures diagrams/hover.yaml -o both.pdf

Several logs are drawn over each other, two also with their difference. FILE of --figures is a diagram, or
has only the key 'figures'; without it the figures are those of the first log's diagram."""
EXPORT_HELP = """\
examples:
  quadvis export runs/hover.mcap -o hover.csv
  quadvis export runs/hover.mcap --signals craft.position,craft.attitude --every '10 ms' -o hover.parquet
  quadvis export diagrams/hover.yaml --fmu control

Of a log: .csv and .parquet have one row for each time. A sampled signal holds its value until its next
sample, a continuous one moves in straight lines; what is missing is empty or NaN. In .mat and .npz each
signal has its own times; .ulg is for the viewers of PX4's logs, and has whole microseconds.

Of a part, with --fmu:
Inputs are the inputs of the part, or what its blocks read from outside; outputs are those of the part, or, of
a whole diagram, what it logs; parameters are those that can be tuned. All are in SI units. The FMU has its
source in C and its library for this machine, and needs nothing of quadvis. At each communication point it has
run all ticks before; its outputs are those of the tick at that time, with the inputs that were set last.
Only numeric blocks can be exported; a C compiler must be there, and numba.
Exit code: 0 done, fmpy finds no problem in it; 2 it cannot be exported, or bad input."""

ANALYSE_HELP = """\
Noise is removed, Newton's method finds a steady state nearby, and the loop is linearised there;
a sampled loop is lifted over one hyperperiod. All signals of a cut are opened together. A transfer goes from
a disturbance that is added to an output (for all readers) or to an input (for its block) to another signal.
With -o the loops' Bode and Nyquist plots and the transfers' Bode plots and steps are drawn.
--json prints one object: diagram, variant, hash, hyperperiod_s (0 for a continuous loop), states, stable,
passed; poles: [[real, imaginary]] in 1/s; cuts: {name: {signals, gain_up, gain_down, phase_lag, phase_lead,
delay, crossover, sensitivity_peak, complementary_peak}} in factors, rad, s and rad/s, null for no limit;
transfers: {name: {from, to, open, unit, hyperperiod_s, stable, dc_gain, bandwidth, peak, peak_frequency,
resonance, rise_time, overshoot, settling_time}} in the unit, rad/s and s, null for none;
limits: {name: {vary, unit, stable_to, reached, reason}};
expect: [{expectation, label, kind, unit, limit, found, met, lack (why nothing is found)}].
Exit code: 0 stable, with all requirements on loops met that the diagram has; 1 not stable, or one not met;
2 bad input, or a loop that cannot be linearised."""

IDENTIFY_HELP = """\
examples:
  quadvis identify runs/motor.mcap --input drive.y --output motor.y --order 2 --zeros 0
  quadvis identify bench.csv --input voltage --output speed --order 1 --delay --after '2 s'

The model has its noise on the output. Least squares seek the coefficients with which the simulated output is
nearest to the recorded one: scipy's least_squares from the coefficients of ARX models. The input is held
between its samples. Standard deviations are those of white noise; the fit is 100 % if the output is met and
0 % if it is no nearer than its mean. The block that is printed can be pasted under 'blocks'.
--json prints one object: input, output, unit, period_s (0: continuous), delay_s, numerator, denominator,
numerator_deviation, denominator_deviation (highest powers first), poles: [[real, imaginary]], fit_percent,
fit_own_percent (of what was fitted), noise, colour (the correlation of neighbouring residuals), samples,
block, plot.
Exit code: 0 found, 2 bad input, or a recording that does not determine the model."""


KEYS_HELP = """\
new makes a key pair, show prints all public keys and fingerprints, allow and revoke change the list of hosts
that a target on this computer lets in (a target that runs notes it at once), forget drops the pinned key of
a target. All is kept in $QUADVIS_HOME, else in $XDG_CONFIG_HOME/quadvis or ~/.config/quadvis; a private key
never leaves it."""


@functools.cache
def parser() -> Parser:
    """Return the parser that this process has, which a console asks for at every line."""
    return new_parser()


def new_parser() -> Parser:
    """Return a parser of all commands and their options."""
    made = Parser(prog="quadvis", description="Block diagrams in YAML that fly a four-rotor craft.")
    made.add_argument("--version", action="version", version=f"quadvis {__version__}")
    subparsers = made.add_subparsers(required=True, metavar="COMMAND")
    made.commands = subparsers.choices

    def add(name: str, command: Any, words: str, epilog: str = "") -> Parser:
        added: Parser = subparsers.add_parser(
            name, help=words, description=f"{words[:1].upper()}{words[1:]}.", epilog=epilog,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        added.set_defaults(command=command)
        return added

    run = add("run", run_commands.run, "run a diagram and judge it by what it expects", JSON_HELP)
    _diagram_options(run)
    run.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    run.add_argument("--seed", type=int, metavar="N", help="seed of all noise; replaces the diagram's")
    run.add_argument(
        "--log",
        metavar="PATH",
        help="where to write the log; default runs/NAME-VARIANT-SETS.mcap, '' for none",
    )
    _engine_option(run)
    _real_time_options(run)
    words = "fly it on a target, by its name or address, and bring the log home"
    run.add_argument("--target", metavar="NAME", help=words)
    words = "let a target be one of the diagram's computers; once for each computer, such as --on world=lab1"
    run.add_argument("--on", action="append", default=[], metavar="COMPUTER=TARGET", help=words)
    words = "time every call of a block; write a trace for Perfetto or chrome://tracing there, '' for none"
    run.add_argument("--profile", metavar="PATH.json", help=words)
    run.add_argument("--json", action="store_true", help="print one JSON object instead of the summary")
    _replay_options(add("replay", run_commands.replay, "repeat a run from its log, to the bit", REPLAY_HELP))
    _sweep_options(add("sweep", run_commands.sweep, "run a diagram at every point of a grid", SWEEP_HELP))
    _tune_options(add("tune", run_commands.tune, "look for the best values of parameters", TUNE_HELP))
    check = add("check", diagram_commands.check, "check a diagram and report all its faults", CHECK_HELP)
    _diagram_options(check)
    words = "run it also with a half and a quarter of the solver's step, and say what this changes"
    check.add_argument("--accuracy", action="store_true", help=words)
    check.add_argument("--json", action="store_true", help="print the faults and warnings as JSON")
    blocks = add(
        "list", library_commands.list_blocks, "list all blocks, and the files that come with quadvis"
    )
    words = "show what has these words in its name or its text; the words of other programs count, too"
    blocks.add_argument("words", nargs="*", metavar="WORD", help=words)
    blocks.add_argument("--json", action="store_true", help="print the declarations of blocks as JSON")
    _own_block_option(blocks)
    describe = add(
        "describe",
        library_commands.describe,
        "describe a block or a part: ports, parameters; or show a file that comes with quadvis",
    )
    describe.add_argument(
        "block", metavar="BLOCK", help="such as signal.derivative, parts/pi.yaml, or quadvis:parts/craft.yaml"
    )
    describe.add_argument("--json", action="store_true", help="print its declarations as JSON")
    _own_block_option(describe)
    analyse = add(
        "analyse",
        diagram_commands.analyse,
        "linearise the loop: poles, margins, transfers, limits",
        ANALYSE_HELP,
    )
    _diagram_options(analyse)
    words = "another cut point: one signal or several, such as torque=control/roll.torque; may be repeated"
    analyse.add_argument("--cut", action="append", default=[], metavar="[NAME=]SIGNAL,...", help=words)
    words = "another transfer: from one signal to another one, such as reference=speed.y,motor.y"
    analyse.add_argument("--transfer", action="append", default=[], metavar="[NAME=]FROM,TO", help=words)
    words = "how far a parameter can go, such as eyes/camera.latency='100 ms..2 s'; may be repeated"
    analyse.add_argument("--vary", action="append", default=[], metavar="PARAM=FROM..TO", help=words)
    analyse.add_argument("--at", metavar="T", help="time at which the operating point is sought")
    _engine_option(analyse)
    analyse.add_argument("--json", action="store_true", help="print one JSON object instead of the tables")
    analyse.add_argument("--output", "-o", metavar="FOLDER", help="write plots there, as PNG")
    _identify_options(
        add("identify", diagram_commands.identify, "find a transfer function from a recording", IDENTIFY_HELP)
    )
    draw = add("draw", diagram_commands.draw, "draw a diagram as SVG")
    _diagram_options(draw)
    draw.add_argument("--part", metavar="PART", help="draw the inside of this part, such as control")
    words = "draw what lies deeper as one box each: with 1 the parts of the diagram itself"
    draw.add_argument("--depth", type=positive, metavar="N", help=words)
    words = "default NAME.svg, with the variant and the part in it; '-' for standard output"
    draw.add_argument("--output", "-o", metavar="PATH", help=words)
    words = "write a PDF: the whole on the first page, then each part on a page of its own"
    draw.add_argument("--book", metavar="FILE.pdf", help=words)
    words = "paper of the book; the smaller one on which all is legible, if left out"
    draw.add_argument("--paper", choices=("a4", "a3"), help=words)
    export = add(
        "export", run_commands.export, "write a log's signals, or a part, for other programs", EXPORT_HELP
    )
    _diagram_options(export)
    words = "as an FMU: a part or a block of the diagram, or '.' for all of it"
    export.add_argument("--fmu", metavar="PART", help=words)
    words = "version of FMI, 2 or 3; default 2"
    export.add_argument("--fmi", type=int, choices=(2, 3), default=2, metavar="N", help=words)
    words = "of a log: these signals, divided by commas; may be repeated"
    export.add_argument("--signals", metavar="A,B", action="append", default=[], help=words)
    export.add_argument("--rate", metavar="NAME", help="of a log: the signals of this rate alone")
    words = "of a log: rows of this distance, such as '10 ms'; default: one for each time of a sample"
    export.add_argument("--every", metavar="T", help=words)
    words = (
        "of a log: .csv, .parquet, .mat, .npz or .ulg; of a part: default PART.fmu, or NAME.fmu for all of it"
    )
    export.add_argument("--output", "-o", metavar="PATH", help=words)
    program = add(
        "program", diagram_commands.program, "print what is called at which ticks, and in which order"
    )
    _diagram_options(program)
    _diff_options(
        add(
            "diff",
            diagram_commands.diff,
            "print what differs between two diagrams, variants or logs",
            DIFF_HELP,
        )
    )
    words = "merge two versions of a file that come from a third one, by block and key; for git"
    merge = add("merge", diagram_commands.merge, words, MERGE_HELP)
    merge.add_argument("base", metavar="BASE", help="what both come from")
    merge.add_argument("ours", metavar="OURS", help="one of them, which becomes the result")
    merge.add_argument("theirs", metavar="THEIRS", help="the other one")
    words = "write YAML files in the house style, with their comments and their meaning"
    style = add("fmt", diagram_commands.fmt, words, FMT_HELP)
    style.add_argument("files", metavar="FILE", nargs="+", help="diagrams, parts, or other YAML files")
    style.add_argument(
        "--check", action="store_true", help="write nothing; exit code 1 if a file would change"
    )
    style.add_argument("--diff", action="store_true", help="write nothing; print what would change")
    _plot_options(
        add("plot", run_commands.plot, "draw the figures of a log, or of several in one", PLOT_HELP)
    )
    schema = add("schema", library_commands.schema, "print the JSON schema of diagrams, for editors")
    schema.add_argument("--output", "-o", metavar="PATH", help="default: standard output")
    _own_block_option(schema)
    completion = add(
        "completion", library_commands.completion, "print what a shell needs to complete words", SHELL_HELP
    )
    completion.add_argument(
        "shell", choices=("bash", "zsh", "tcsh", "fish"), metavar="SHELL", help="bash, zsh, tcsh, fish"
    )
    _camera_options(
        add(
            "camera",
            library_commands.camera,
            "list cameras, show what one sees, or calibrate it",
            CAMERA_HELP,
        )
    )
    cache = add("cache", library_commands.cache, "say where compiled blocks are kept, and how large they are")
    cache.add_argument("--clear", action="store_true", help="remove them all")
    add_target_commands(add, _setting_options, _engine_option)
    new = add(
        "new", library_commands.new, "write the skeleton of a block, an output device, a diagram or a project"
    )
    new.add_argument("kind", choices=("block", "device", "diagram", "project"))
    new.add_argument(
        "name",
        metavar="NAME",
        help="group.block of a block or device, FILE.yaml of a diagram, the folder of a project",
    )
    _key_options(
        add("keys", wire.keys, "make and show keys, and say which hosts a target lets in", KEYS_HELP)
    )
    add("wire", wire.wire, "print how to talk to a target, for programs in other languages")
    return made


def _key_options(parser: Parser) -> None:
    parser.add_argument("action", choices=wire.ACTIONS)
    parser.add_argument(
        "name", metavar="NAME", nargs="?", help="of a key, of a host, or of a target (forget)"
    )
    words = "with allow: the host's public key, 64 hexadecimal digits"
    parser.add_argument("public", metavar="PUBLIC", nargs="?", help=words)
    words = "with allow: 0 all, 1 starts and stops, 2 sees parameters, 3 looks, 4 sees the status"
    parser.add_argument("--level", type=int, metavar="0..4", help=words)
    words = "with allow: the host must come from there, such as 192.168.1.0/24; may be repeated"
    parser.add_argument("--from", dest="network", action="append", default=[], metavar="NETWORK", help=words)


def _camera_options(parser: Parser) -> None:
    words = "path in /dev/v4l/by-id, number, URL, or video file; without it, cameras are listed"
    parser.add_argument("device", metavar="DEVICE", nargs="?", help=words)
    words = "what its pictures must have, such as 640x480; default: as the camera gives them"
    parser.add_argument("--size", type=dimensions, metavar="WxH", help=words)
    words = "write pictures into this folder, as PNG; with --calibrate, the camera's file"
    parser.add_argument("--output", "-o", metavar="PATH", help=words)
    parser.add_argument("--count", type=positive, default=1, metavar="N", help="of the pictures; default 1")
    words = "calibrate with a chessboard of so many inner corners, such as 9x6"
    parser.add_argument("--calibrate", type=dimensions, metavar="BOARD", help=words)
    parser.add_argument("--square", metavar="25mm", help="with --calibrate: side of one square of the board")
    words = "with --calibrate: go on with the views that there are after so many seconds without a new one"
    parser.add_argument("--idle", type=positive, default=30, metavar="S", help=words)


def _replay_options(parser: Parser) -> None:
    parser.add_argument("log", metavar="LOG")
    _set_option(parser)
    words = "the diagram's folder, if it is no longer where the log says"
    parser.add_argument("--folder", metavar="FOLDER", help=words)
    parser.add_argument("--output", "-o", metavar="NEWLOG", help="write a log of the replay; default: none")
    _engine_option(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of the report")
    _own_block_option(parser)


def _diff_options(parser: Parser) -> None:
    parser.add_argument("old", metavar="A", help="a diagram or a log")
    parser.add_argument("new", metavar="B", nargs="?", help="another one; default: A in another variant")
    words = (
        "print A with a line for each value, its keys before it; git compares such lines, see 'quadvis merge'"
    )
    parser.add_argument("--git", action="store_true", help=words)
    words = "the variant of A, and that of B; 'none' is the diagram without one"
    parser.add_argument("--variants", nargs=2, metavar=("X", "Y"), help=words)
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of the text")
    _own_block_option(parser)


def _engine_option(parser: Parser) -> None:
    words = "python starts at once; native compiles, once, and is much faster; auto takes the sooner one"
    parser.add_argument("--engine", choices=("auto", "python", "native"), default="auto", help=words)


def _real_time_options(parser: Parser) -> None:
    words = "let each tick wait for its time, in a process of its own; needs Linux"
    parser.add_argument("--real-time", action="store_true", help=words)
    words = "with --real-time: the processor for the loop"
    parser.add_argument("--cpu", type=int, metavar="N", help=words)
    words = "with --real-time: the priority of the fastest task, 1 to 99, or 0 for none; default 80"
    parser.add_argument("--priority", type=int, metavar="P", help=words)
    words = "with --real-time: look at the clock so long before each tick, such as '60 us'; default auto"
    parser.add_argument("--poll", metavar="T", help=words)


def _own_block_option(parser: Parser) -> None:
    words = "refuse to run the code in the folder blocks beside the diagram"
    parser.add_argument("--no-own-blocks", action="store_true", help=words)


def _diagram_options(parser: Parser) -> None:
    parser.add_argument("file", metavar="FILE", help="the diagram")
    parser.add_argument("--variant", metavar="V", help="one of the diagram's variants")
    _setting_options(parser)


def _setting_options(parser: Parser) -> None:
    words = "file of settings, applied before --set; may be repeated, later files win"
    parser.add_argument("--params", action="append", default=[], metavar="FILE", help=words)
    _set_option(parser)
    _own_block_option(parser)


def _set_option(parser: Parser) -> None:
    words = "replace a parameter, such as control/roll.bandwidth='2 rad/s'; may be repeated"
    parser.add_argument("--set", action="append", default=[], metavar="BLOCK.PARAM=VALUE", help=words)


def _identify_options(parser: Parser) -> None:
    parser.add_argument("log", metavar="LOG", help="log of a run, or a file .csv, .parquet, .mat or .npz")
    parser.add_argument("--input", required=True, metavar="SIGNAL", help="what drives it, such as drive.y")
    parser.add_argument("--output", required=True, metavar="SIGNAL", help="what answers, such as motor.y")
    parser.add_argument("--order", required=True, type=positive, metavar="N", help="the number of poles")
    words = "the number of zeros, at most as many as poles; default: one less"
    parser.add_argument("--zeros", type=int, metavar="M", help=words)
    parser.add_argument("--delay", action="store_true", help="seek a dead time of whole samples, too")
    parser.add_argument("--discrete", action="store_true", help="in powers of z; default: of s, continuous")
    parser.add_argument("--after", metavar="T", help="leave out what is earlier, such as '2 s'")
    words = "the share of the samples, at the end, that is not fitted and judges the model; default 1/3"
    parser.add_argument("--validation", type=float, metavar="SHARE", help=words)
    parser.add_argument("--plot", metavar="PNG", help="draw the recorded and the simulated output there")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of the text")


def _plot_options(plot: Parser) -> None:
    plot.add_argument("logs", metavar="LOG", nargs="+", help="log of a run, or of several to be compared")
    words = "draw these signals, divided by commas; may be repeated"
    plot.add_argument("--signals", metavar="A,B", action="append", default=[], help=words)
    plot.add_argument("--against", metavar="SIGNAL", help="what lies across in place of the time")
    words = "take the figures of this diagram, or of a file with 'figures' alone, in place of the log's own"
    plot.add_argument("--figures", metavar="FILE", help=words)
    words = "draw the lateness and execution times of a real-time run's tasks"
    plot.add_argument("--times", action="store_true", help=words)
    plot.add_argument("--show", action="store_true", help="open what was drawn")
    words = "a file .svg, .pdf (all figures) or .png, or a folder for PNG files; default: beside the log"
    plot.add_argument("--output", "-o", metavar="PATH", help=words)
    _own_block_option(plot)


def _tune_options(parser: Parser) -> None:
    _diagram_options(parser)
    words = "a number of the summary, such as xy.rms"
    parser.add_argument("--minimise", metavar="NUMBER", required=True, help=words)
    words = "a parameter and its range, such as bandwidth='1..6 rad/s'; may be repeated"
    parser.add_argument("--over", action="append", required=True, metavar="NAME=FROM..TO", help=words)
    words = "take the mean over runs with these seeds, such as 0..9; default: the diagram's seed"
    parser.add_argument("--seeds", metavar="VALUES", help=words)
    words = "bounded (of one parameter), nelder-mead (of several), powell, or evolution"
    parser.add_argument("--method", metavar="METHOD", help=words)
    parser.add_argument("--trials", type=positive, default=60, metavar="N", help="most trials; default 60")
    words = "count only trials that meet all expectations"
    parser.add_argument("--passing", action="store_true", help=words)
    parser.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    _engine_option(parser)
    words = "write the values there, as a file for --params"
    parser.add_argument("--output", "-o", metavar="FILE.yaml", help=words)


def _sweep_options(parser: Parser) -> None:
    parser.add_argument("file", metavar="FILE", help="the diagram")
    words = (
        "seed=0..29, craft.lag='20 ms,50 ms', bandwidth='1..3 step 0.5 rad/s', variant=A,B; may be repeated"
    )
    parser.add_argument("--over", action="append", default=[], metavar="NAME=VALUES", help=words)
    words = "grid (default), latin_hypercube, sobol, random, saltelli or one_at_a_time: which runs, see below"
    parser.add_argument("--design", default="grid", metavar="NAME", help=words)
    parser.add_argument(
        "--runs", type=int, metavar="N", help="how many runs the design has; a grid says so itself"
    )
    words = "stop when half of a 95 %% interval is so small: 'failing within 2 %%', 'xy.rms within 0.1 cm'"
    parser.add_argument("--until", metavar="'WHAT within SIZE'", help=words)
    words = "quantiles of the summary, in %%; default 5,50,95 for a design, none for a grid"
    parser.add_argument("--quantiles", metavar="P,Q", help=words)
    words = "draw how much of the spread is due to each axis (Sobol's indices, by SALib)"
    parser.add_argument("--sensitivity", metavar="PNG", help=words)
    words = "one of the diagram's variants; several are swept over"
    parser.add_argument("--variant", action="append", default=[], metavar="V", help=words)
    _setting_options(parser)
    parser.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of every run, and of the design's draw")
    _engine_option(parser)
    parser.add_argument("--workers", type=int, metavar="N", help="processes; default: one per processor")
    words = "let the workers of a Dask cluster do the runs: the address of its scheduler, tcp://host:8786"
    parser.add_argument("--cluster", metavar="ADDRESS", help=words)
    words = "the table, .csv or .parquet, 'x.parquet/' for a folder of parts; default runs/NAME-sweep.csv"
    parser.add_argument("--output", "-o", metavar="TABLE", help=words)
    words = "picture of the summary; default: beside the table, '' for none"
    parser.add_argument("--plot", metavar="PNG", help=words)
    parser.add_argument("--logs", metavar="FOLDER", help="write a log of every run; default: none")
    parser.add_argument("--resume", action="store_true", help="keep the runs that the table has already")
    parser.add_argument("--timings", action="store_true", help="add the wall time of each run to the table")
