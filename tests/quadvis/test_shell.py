"""Failures around a command never give a traceback: one sentence, an exit code, and whole outputs."""

from __future__ import annotations

import errno
import hashlib
import os
import resource
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any

import pytest

from quadvis.cli import main
from quadvis.errors import QuadvisError, RunError
from quadvis.machine import exits as shell
from quadvis.machine.failures import MEMORY
from quadvis.output.log_reader import read_log
from tests.stages import mostly_slow

TOOLS = Path(__file__).parents[2] / "tools"
LONG, DEEP = "a" * 300, "b/" * 3000
DIAGRAM = """\
quadvis: 1
name: step
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast}
  lag: {block: signal.low_pass, rate: fast, with: {time_constant: 0.1 s}, in: {u: wave.y}}
figures:
  - {title: Höhe, signals: [wave.y, lag.y], reference: 0.5}
"""
Captured = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT), sys.unraisablehook
    monkeypatch.chdir(tmp_path)
    (tmp_path / "step.yaml").write_text(DIAGRAM, encoding="utf-8")
    yield tmp_path
    signal.signal(signal.SIGTERM, before[0])
    signal.signal(signal.SIGINT, before[1])
    sys.unraisablehook = before[2]


def command(
    script: str, *, before: Callable[[], Any] | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a line of a shell in which `quadvis` is the command line."""
    named = f'quadvis() {{ "{sys.executable}" -m quadvis "$@"; }}\n{script}'
    return subprocess.run(
        ["bash", "-c", named], capture_output=True, text=True, timeout=120, check=False, preexec_fn=before,
        env={**os.environ, **environment}, errors="surrogateescape",
    )  # fmt: skip


# Exceptions that reach the door.


def raising(error: BaseException) -> Callable[[], int]:
    def command() -> int:
        raise error

    return command


def nested(depth: int = 0) -> int:
    return nested(depth + 1)


@pytest.mark.parametrize(
    ("fault", "code", "words"),
    [
        (QuadvisError("no such thing"), 2, "no such thing"),
        (RunError("stopped", block="a", time=1.0), 1, "block 'a', t = 1 s: stopped"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (MemoryError(), 1, MEMORY),
        (MemoryError("Unable to allocate 3 TiB"), 1, MEMORY),
        (OSError(errno.ENOMEM, os.strerror(errno.ENOMEM)), 1, MEMORY),
        (RecursionError("deep"), 2, "this is nested too deeply, or calls itself without end"),
        (OSError(errno.ENAMETOOLONG, "File name too long", "x"), 2, "cannot use 'x': file name too long"),
        (
            PermissionError(errno.EACCES, "Permission denied", b"x\xff"),
            2,
            "cannot use 'x\\udcff': permission",
        ),
        (OSError(errno.EMFILE, "Too many open files"), 2, "the system refused: too many open files"),
        (FileNotFoundError(errno.ENOENT, "No such file", "x"), 2, "cannot use 'x': there is no such file"),
        (ImportError("a\nlong\nstory", name="numpy"), 2, "numpy cannot be loaded: a\n"),
        (ModuleNotFoundError("No module named 'x'", name="x"), 2, "x cannot be loaded: "),
        ("\udcff".encode, 2, "a text holds characters that cannot be read or written: "),
        (nested, 2, "this is nested too deeply, or calls itself without end"),
    ],
)
def test_a_failure_of_the_surroundings_is_a_sentence(
    fault: Any, code: int, words: str, capsys: Captured
) -> None:
    assert shell.ended(fault if callable(fault) else raising(fault)) == code
    error = capsys.readouterr().err
    assert error.startswith(words) or error.encode("ascii", "backslashreplace").decode().startswith(words)
    assert error.count("\n") == 1


@pytest.mark.parametrize("fault", [ValueError("bug"), KeyError("bug"), AssertionError(), SystemExit(3)])
def test_a_fault_of_the_program_passes(fault: BaseException) -> None:
    with pytest.raises(type(fault)):
        shell.ended(raising(fault))


def test_a_name_stands_before_the_sentence_and_notes_behind(capsys: Captured) -> None:
    error = QuadvisError("no")
    error.add_note("and more")
    assert shell.ended(raising(error), "tool") == 2
    assert capsys.readouterr().err == "tool: no\nand more\n"


def test_where_the_folder_is_gone_that_is_said(project: Path, capsys: Captured) -> None:
    (project / "gone").mkdir()
    os.chdir(project / "gone")
    (project / "gone").rmdir()
    assert shell.ended(lambda: len(os.getcwd())) == 2
    assert capsys.readouterr().err == "the current folder is gone; change to one that exists\n"


@pytest.mark.parametrize(
    "words",
    ["run step.yaml", "check step.yaml", "draw step.yaml", "list", "schema", "plot x.mcap",
     "new diagram x.yaml",
     "new block a.b", "describe signal.gain", "sweep step.yaml --over seed=0..1", "analyse step.yaml"],
)  # fmt: skip
def test_in_a_folder_that_is_gone_every_command_ends_without_a_traceback(
    words: str, project: Path, capsys: Captured
) -> None:
    (project / "gone").mkdir()
    os.chdir(project / "gone")
    (project / "gone").rmdir()
    assert main(words.split()) == (0 if words in ("list", "schema", "describe signal.gain") else 2)


@pytest.mark.parametrize("name", [LONG, DEEP])
@pytest.mark.parametrize(
    "words",
    ["run NAME", "run step.yaml --log NAME", "run step.yaml --params NAME", "run step.yaml --variant NAME",
     "run step.yaml --set NAME=1", "check NAME", "draw NAME", "draw step.yaml -o NAME.svg", "plot NAME",
     "plot step.mcap -o NAME", "schema -o NAME", "new diagram NAME.yaml", "new block a.NAME", "describe NAME",
     "sweep NAME --over seed=0..1", "sweep step.yaml --over seed=0..1 -o NAME.csv",
     "sweep step.yaml --over params=NAME -o x.csv", "analyse NAME", "analyse step.yaml -o NAME"],
)  # fmt: skip
def test_names_longer_than_the_system_takes_are_a_sentence(
    words: str, name: str, project: Path, capsys: Captured
) -> None:
    main(["run", "step.yaml", "--log", "step.mcap"])
    before = sorted(project.rglob("*.yaml"))
    capsys.readouterr()
    code = main([word.replace("NAME", name) for word in words.split()])
    captured = capsys.readouterr()
    # Without a cut there is no plot, and so nothing to write.
    assert code == (0 if words.startswith("analyse step") and name == DEEP else 2) or "analyse step" in words
    assert captured.err.count("\n") == (1 if code else 0)
    assert sorted(project.rglob("*.yaml")) == before


# Streams.


@pytest.mark.parametrize(
    ("closed", "code"),
    mostly_slow(
        [("<&- >&- 2>&-", 0), (">/dev/full", 1), (">&-", 0), ("2>&-", 0), (">&- 2>&-", 0), ("<&-", 0),
         (">/dev/full 2>/dev/full", 1), ("2>/dev/full", 0), (">&- 2>/dev/full", 0), (">/dev/full 2>&-", 1)],
        2,
    ),
)  # fmt: skip
def test_a_run_without_its_streams_leaves_a_whole_log(closed: str, code: int) -> None:
    done = command(f"quadvis run step.yaml --log step.mcap {closed}")
    assert done.returncode == code
    told = "cannot write to standard output: no space left on device\n"
    assert done.stderr == (told if code and "2>" not in closed else "")
    log = read_log("step.mcap")
    assert log.complete and len(log["lag.y"]) == 101
    assert Path("step.mcap").read_bytes()[:5] == b"\x89MCAP"


@pytest.mark.parametrize("unbuffered", mostly_slow(["", "1"]))
@pytest.mark.parametrize(
    "words", mostly_slow(["check step.yaml --json", "list", "schema", "--help", "draw step.yaml -o -"])
)
def test_a_full_standard_output_is_one_sentence(words: str, unbuffered: str) -> None:
    done = command(f"quadvis {words} >/dev/full", PYTHONUNBUFFERED=unbuffered)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "cannot write to standard output: no space left on device\n"


@pytest.mark.parametrize("closed", mostly_slow(["2>&-", "2>/dev/full"]))
def test_a_fault_that_cannot_be_told_keeps_its_exit_code(closed: str) -> None:
    assert command(f"quadvis run none.yaml {closed}").returncode == 2


class Gone:
    """A terminal that has hung up."""

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        raise OSError(errno.EIO, "gone")

    def flush(self) -> None:
        raise OSError(errno.EIO, "gone")


def test_a_run_goes_on_when_the_terminal_of_its_progress_has_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Gone())
    assert main(["run", "step.yaml", "--log", "step.mcap"]) == 0
    assert read_log("step.mcap").complete


def test_progress_never_goes_beyond_the_end() -> None:
    from quadvis.machine.status_line import ProgressLine

    shown = []
    line = ProgressLine(1.0)
    line.show = shown.append  # type: ignore[method-assign]
    for reached in (0.0, 0.5, 1.0, 1.1, 2.0):
        line(reached, 0.1)
    assert [text.split("]")[1].split(" s")[0].strip() for text in shown] == [
        "0.0 / 1", "0.5 / 1", "1.0 / 1", "1.0 / 1", "1.0 / 1",
    ]  # fmt: skip


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-16", "koi8-r", "shift_jis"])
def test_a_terminal_of_any_encoding_gets_what_it_can_show(
    encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = BytesIO()
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(raw, encoding))
    Path("step.yaml").write_text(
        DIAGRAM.replace("name: step", "name: Höhe ψ 飛 \U0001f681"), encoding="utf-8"
    )
    assert main(["run", "step.yaml", "--log", ""]) == 0
    assert "H" in raw.getvalue().decode(encoding)


@pytest.mark.parametrize(
    "environment",
    mostly_slow([
        {"LC_ALL": "C"}, {"LC_ALL": "POSIX"}, {"LC_ALL": "C.UTF-8"}, {"LANG": ""},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"PYTHONIOENCODING": "ascii:strict"}, {"PYTHONWARNINGS": "error"},
        {"PYTHONWARNINGS": "error", "PYTHONWARNDEFAULTENCODING": "1"}, {"PYTHONDONTWRITEBYTECODE": "1"},
        {"HOME": "/nowhere", "XDG_CACHE_HOME": "/nowhere", "XDG_CONFIG_HOME": "/nowhere"},
        {"PYTHONNOUSERSITE": "1", "COLUMNS": "-3", "TERM": "none"},
    ], quick=1),
)  # fmt: skip
def test_locale_warnings_and_home_change_nothing(environment: Mapping[str, str]) -> None:
    script = "quadvis run step.yaml --log hö.mcap && quadvis plot hö.mcap -o out && quadvis draw step.yaml"
    done = command(script, **environment)
    assert (done.returncode, done.stderr) == (0, "")
    (picture,) = Path("out").iterdir()
    assert picture.name == ("1-h-he.png" if environment.get("PYTHONUTF8") == "0" else "1-höhe.png")


def test_warnings_are_shown_where_they_would_be_errors(
    monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setattr(sys, "warnoptions", ["error"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with warnings.catch_warnings(record=True) as shown:
            assert shell.ended(lambda: warnings.warn("old", DeprecationWarning, stacklevel=1) or 0) == 0
        assert [str(warning.message) for warning in shown] == ["old"]


# Memory.


@pytest.mark.parametrize(
    "megabytes", mostly_slow([40, 120, 80, 20, 18, 23, 180, 30, 60, 100, 150, 220], slow=6)
)
def test_little_memory_is_a_sentence(megabytes: int) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    done = subprocess.run(
        [sys.executable, "-m", "quadvis", "run", "step.yaml", "--log", "step.mcap"],
        capture_output=True, text=True, timeout=120, check=False, preexec_fn=limit,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    assert done.returncode in (0, 1, 2)
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == (0 if done.returncode == 0 else 1)


def test_the_sentence_for_which_nothing_can_be_imported_is_that_of_all_others() -> None:
    start = Path(shell.__file__).parents[1] / "__main__.py"
    assert f"{MEMORY}\\n" in start.read_text(encoding="utf-8")


# Ctrl-C.


def test_an_interruption_that_an_import_turned_into_another_error_is_still_one(capsys: Captured) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    shell.listen()

    def swallowed() -> int:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("a library gave up") from None
        return 0

    assert shell.ended(swallowed) == 130
    assert capsys.readouterr().err == "interrupted\n"


@pytest.mark.slow
def test_an_interruption_that_python_had_to_drop_comes_again(capsys: Captured) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    shell.listen()

    class Dropping:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def command() -> int:
        thing = Dropping()
        del thing
        time.sleep(10.0)  # it is interrupted
        return 0

    with pytest.MonkeyPatch.context() as patch:  # the tests' own hook tells of what is dropped
        patch.setattr(sys, "unraisablehook", shell._unraisable)
        assert shell.ended(command) == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_an_ignored_interruption_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    shell.listen()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


IMPORTS = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == NAME:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
sys.argv = ["quadvis", *ARGUMENTS]
sys.path.insert(0, ".")
from quadvis.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize(
    ("name", "arguments"),
    mostly_slow([
        ("numpy._core._multiarray_umath", "run step.yaml"),
        ("matplotlib.rcsetup", "plot step.mcap"),
        ("quadvis.machine.exits", "list"),
        ("quadvis.errors", "list"),
        ("quadvis.cli", "list"),
        ("argparse", "list"),
        ("quadvis.cli.options", "list"),
        ("quadvis.library.catalogue", "list"),
        ("numpy", "run step.yaml"),
        ("numpy.linalg", "run step.yaml"),
        ("yaml", "check step.yaml"),
        ("quadvis.run.session", "run step.yaml"),
        ("matplotlib", "plot step.mcap"),
        ("matplotlib.figure", "plot step.mcap"),
        ("matplotlib.font_manager", "plot step.mcap"),
        ("quickjs", "draw step.yaml"),
        ("quadvis.sweeps.sweep", "sweep step.yaml --over seed=0..1"),
    ]),
)  # fmt: skip
def test_ctrl_c_while_a_module_is_imported_is_no_traceback(name: str, arguments: str) -> None:
    main(["run", "step.yaml", "--log", "step.mcap"])
    text = IMPORTS.replace("NAME", repr(name)).replace("ARGUMENTS", repr(arguments.split()))
    done = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


# Matplotlib.

PLAIN = "plain"
RC_FILES: dict[str, bytes] = {
    "unknown keys": b"no.such.key: 3\nlines.linewidt: 7\n",
    "wrong values": b"figure.dpi: many\nfont.size: huge\n",
    "no colons": b"this is no rc file at all\n\x00\n",
    "other bytes": b"\xff\xfe\x00broken",
    "usetex": b"text.usetex: True\n",
    "huge dpi": b"figure.dpi: 100000\nsavefig.dpi: 100000\n",
    "another backend": b"backend: module://no.such.module\n",
    "another look": b"axes.facecolor: red\nlines.linewidth: 20\nfont.family: serif\nsavefig.bbox: tight\n",
    "strange paths": b"path.sketch: 10, 100, 2\nagg.path.chunksize: 3\npath.effects: []\n",
    "locale": b"axes.formatter.use_locale: True\n",
    "transparent": b"savefig.transparent: True\nsavefig.format: pdf\nfigure.autolayout: True\n",
}
SURROUNDINGS: dict[str, dict[str, str]] = {
    "notebook": {"MPLBACKEND": "module://matplotlib_inline.backend_inline"},
    "no such backend": {"MPLBACKEND": "nonsense"},
    "no display": {"MPLBACKEND": "qtagg", "DISPLAY": ""},
    "empty backend": {"MPLBACKEND": ""},
    "config is a device": {"MPLCONFIGDIR": "/dev/null"},
    "config is nowhere": {"MPLCONFIGDIR": "/proc/nowhere", "HOME": "/proc/nowhere"},
    "rc is a device": {"MATPLOTLIBRC": "/dev/zero"},
    "rc is nowhere": {"MATPLOTLIBRC": "/nowhere"},
}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The digest of the figure without anything strange around."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "step.yaml").write_text(DIAGRAM, encoding="utf-8")
    main(["run", str(folder / "step.yaml"), "--log", str(folder / "step.mcap")])
    main(["plot", str(folder / "step.mcap"), "-o", str(folder / "out")])
    return digest(folder / "out")


def digest(folder: Path) -> str:
    (picture,) = folder.iterdir()
    return hashlib.sha256(picture.read_bytes()).hexdigest()


@pytest.mark.parametrize(
    "name", mostly_slow(["notebook", "other bytes", "a pipe", *RC_FILES, *SURROUNDINGS, "home"])
)
def test_figures_are_the_same_whatever_surrounds_matplotlib(name: str, plain: str) -> None:
    main(["run", "step.yaml", "--log", "step.mcap"])
    environment = SURROUNDINGS.get(name, {})
    if name in RC_FILES:
        Path("matplotlibrc").write_bytes(RC_FILES[name])
    elif name == "a pipe":
        os.mkfifo("matplotlibrc")
    elif name == "home":
        Path("home/.config/matplotlib").mkdir(parents=True)
        Path("home/.config/matplotlib/matplotlibrc").write_bytes(RC_FILES["other bytes"])
        environment = {"HOME": str(Path("home").resolve()), "XDG_CONFIG_HOME": ""}
    done = command("quadvis plot step.mcap -o out", **environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "out/1-höhe.png\n", "")
    assert digest(Path("out")) == plain


@pytest.mark.parametrize(
    "settings",
    mostly_slow([
        {"text.usetex": True}, {"figure.dpi": 1e5}, {"savefig.dpi": 1e5}, {"savefig.bbox": "tight"},
        {"font.family": "serif"}, {"font.size": 40.0}, {"axes.facecolor": "red"}, {"lines.linewidth": 20.0},
        {"path.sketch": (10, 100, 2)}, {"savefig.transparent": True}, {"figure.autolayout": True},
        {"axes.prop_cycle": "cycler('color', ['r'])"}, {"xtick.labelsize": 1.0}, {"legend.loc": "center"},
        {"text.hinting": "none", "text.hinting_factor": 1}, {"figure.facecolor": "black"},
    ], 5),
    ids=str,
)  # fmt: skip
def test_what_a_caller_has_set_in_matplotlib_changes_no_figure_and_is_kept(
    settings: dict[str, Any], plain: str
) -> None:
    import matplotlib as mpl

    main(["run", "step.yaml", "--log", "step.mcap"])
    with warnings.catch_warnings(), mpl.rc_context():
        warnings.simplefilter("ignore")
        mpl.rcParams.update(settings)
        before = {key: mpl.rcParams[key] for key in settings}
        assert main(["plot", "step.mcap", "-o", "out"]) == 0
        assert {key: mpl.rcParams[key] for key in settings} == before
    assert digest(Path("out")) == plain
