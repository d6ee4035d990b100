"""The arguments of `quadvis`: every mistake is reported in one sentence, and right arguments are accepted."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.cli.arguments import understood
from quadvis.cli.options import parser
from quadvis.errors import QuadvisError

HELP = "see 'quadvis --help'"
TUNE = "write 'quadvis tune FILE --minimise NUMBER --over NAME=FROM..TO'"
COMMANDS = (
    "run, replay, sweep, tune, check, list, describe, analyse, identify, draw, export, program, diff, merge, "
    "fmt, plot, schema, completion, camera, cache, target, load, start, stop, unload, status, get, set, "
    "scope, log, sets, profile, web, bridge, console, new, keys, wire"
)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), f"name a command: {COMMANDS}; {HELP}"),
        (("fly",), f"there is no command 'fly'; {HELP}"),
        (("runn", "x.yaml"), "there is no command 'runn'; did you mean 'run'?"),
        (("x.yaml",), f"there is no command 'x.yaml'; {HELP}"),
        (("",), f"there is no command ''; {HELP}"),
        (("-x",), f"there is no option '-x' before a command; {HELP}"),
        (("--json", "run"), f"there is no option '--json' before a command; {HELP}"),
        (("run",), "FILE is missing; write 'quadvis run FILE'"),
        (("run", "--json"), "FILE is missing; write 'quadvis run FILE'"),
        (("run", "a", "b"), "'b' is one too many; write 'quadvis run FILE'"),
        (("schema", "signal"), "'signal' is one too many; write 'quadvis schema'"),
        (("run", "a", "--", "--json"), "'--json' is one too many; write 'quadvis run FILE'"),
        (("new",), "KIND and NAME is missing; write 'quadvis new block|device|diagram|project NAME'"),
        (("new", "block"), "NAME is missing; write 'quadvis new block|device|diagram|project NAME'"),
        (("new", "blok", "a.b"), "KIND cannot be 'blok'; did you mean 'block'?"),
        (
            ("new", "thing", "a.b"),
            "KIND cannot be 'thing'; choose from 'block', 'device', 'diagram', 'project'",
        ),
        (("run", "a", "--stop-tme", "3 s"), "there is no option '--stop-tme'; did you mean '--stop-time'?"),
        (("run", "a", "--stop", "3 s"), "there is no option '--stop'; did you mean '--stop-time'?"),
        (("run", "a", "-q"), "there is no option '-q'; see 'quadvis run --help'"),
        (("check", "a", "--zzz=3"), "there is no option '--zzz'; choose from"),
        (("run", "a", "--stop-time"), "--stop-time needs a value; write --stop-time T"),
        (("run", "a", "--log", "--json"), "--log needs a value; write --log PATH"),
        (("run", "a", "--log", "--seed=3"), "--log needs a value; write --log PATH"),
        (("run", "a", "--log", "--"), "--log needs a value; write --log PATH"),
        (("run", "a", "--log=--"), "--log needs a value; write --log PATH"),
        (("draw", "a", "-o"), "-o needs a value; write -o PATH"),
        (("run", "a", "--seed", "one"), "--seed: 'one' is not a whole number; write one, such as 3"),
        (("run", "a", "--seed=1.5"), "--seed: '1.5' is not a whole number; write one, such as 3"),
        (("run", "a", "--seed="), "--seed: '' is not a whole number; write one, such as 3"),
        (("scope", "a", "--level", "high"), "--level: 'high' is not a number; write one, such as 0.5"),
        (("run", "a", "--engine", "nativ"), "--engine cannot be 'nativ'; did you mean 'native'?"),
        (("export", "a", "--fmu", ".", "--fmi", "4"), "--fmi cannot be '4'; choose from '2', '3'"),
        (("scope", "a", "--timeout", "-1"), "--timeout: '-1' is no number of seconds from 0 to 1e+09; "),
        (("target", "--until-idle", "soon"), "--until-idle: 'soon' is no number of seconds from 0"),
        (("set", "=3"), "'=3' gives no name; write NAME=VALUE"),
        (("set", "k="), "'k=' gives no value; write NAME=VALUE"),
        (("set", "k=1", "k = 2"), "'k' is given twice; give it one value"),
        (("scope", "a", "-o", "a.txt"), "cannot write samples as 'a.txt': give a name that ends in .csv"),
        (("scope", "a", "-o", "no/a.csv"), "cannot write the table 'no/a.csv': there is no folder 'no'"),
        (("profile", "-o", "no/a.json"), "cannot write the trace 'no/a.json': there is no folder 'no'"),
        (("set",), "NAME=VALUE is missing; write 'quadvis set NAME=VALUE [...]'"),
        (("tune", "a", "--over=x=1..2"), f"--minimise is missing; {TUNE}"),
        (("tune", "--minimise=b", "--over=x=1..2"), f"FILE is missing; {TUNE}"),
        (("tune",), f"FILE and --minimise and --over is missing; {TUNE}"),
        (("sets", "kep"), "ACTION cannot be 'kep'; choose from 'list', 'save', 'load'"),
        (("sweep", "a", "--workers", "many"), "--workers: 'many' is not a whole number"),
        (("run", "a", "--json=yes"), "--json takes no value; leave 'yes' out"),
        (("run", "a\0b"), r"'a\x00b' holds a character that no name and no value can have"),
    ],
)
def test_a_slip_is_one_sentence_of_the_house(
    words: Sequence[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(sentence)
    assert captured.err.count("\n") == 1
    assert captured.out == ""


@pytest.mark.parametrize("value", ["-3s", "-3 s", "--5", "-.5 s", "-", "-1e3", "-x", "--x", "", " "])
def test_a_value_that_begins_like_an_option_reaches_its_option(
    value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert understood(parser(), ["run", "a", "--stop-time", value]).stop_time == value
    assert understood(parser(), ["run", "a", f"--stop-time={value}"]).stop_time == value
    (tmp_path / "a.yaml").write_text("quadvis: 1\nname: a\nblocks: {}\n")
    assert main(["run", str(tmp_path / "a.yaml"), f"--stop-time={value}"]) == 2
    assert "--stop-time:" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        (("run", "a", "--seed", "-3"), "seed", -3),
        (("run", "--seed=7", "a"), "seed", 7),
        (("run", "--", "-a.yaml"), "file", "-a.yaml"),
        (("run", "a", "--log", ""), "log", ""),
        (("run", "a", "--log="), "log", ""),
        (("run", "a", "--set", "x.y=-1", "--set", "z.u=2"), "set", ["x.y=-1", "z.u=2"]),
        (("draw", "a", "-o", "-"), "output", "-"),
        (("draw", "a", "-ob.svg"), "output", "b.svg"),
        (("draw", "a", "--output=b.svg"), "output", "b.svg"),
        (("run", "a", "--json"), "json", True),
        (("new", "diagram", "x.yaml"), "kind", "diagram"),
        (("list",), "json", False),
    ],
)
def test_what_is_right_is_taken(words: Sequence[str], name: str, value: object) -> None:
    assert vars(understood(parser(), words))[name] == value


@pytest.mark.parametrize(
    "words", [("--help",), ("-h",), ("run", "--help"), ("run", "a", "b", "-h"), ("new", "-h")], ids=" ".join
)
def test_help_is_shown_whatever_else_is_typed(
    words: Sequence[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 0
    assert "quadvis" in capsys.readouterr().out


def test_what_argparse_alone_would_refuse_is_a_sentence_too() -> None:
    with pytest.raises(QuadvisError, match="this is not understood; see 'quadvis run --help'"):
        parser().commands["run"].parse_args(["--nothing"])


def test_every_option_is_known_to_the_sentences() -> None:
    for command in parser().commands.values():
        declared = {text for action in command._actions for text in action.option_strings}
        assert declared - {"-h", "--help"} == set(command.options)
        plain = [action for action in command._actions if not action.option_strings]
        assert plain == command.places
        assert all(action.nargs in (None, 0, 2, "?", "*", "+") for action in command._actions)
        assert not any(isinstance(action, argparse._SubParsersAction) for action in plain)
