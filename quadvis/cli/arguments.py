"""Read the arguments of `quadvis` and of the tools, and report a wrong one in one sentence.

argparse writes the help and makes the options. This module makes the sentences, from the declared options.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from quadvis.errors import QuadvisError, quoted, sentence, suggestion

HELP = ("-h", "--help")
_PLACES: Mapping[Any, str] = {"?": "[{}]", "*": "[{} ...]", "+": "{} [...]"}


class Parser(argparse.ArgumentParser):
    """A parser that keeps its declarations: ``options`` and ``commands`` by name, ``places`` in order."""

    def __init__(self, **more: Any) -> None:
        super().__init__(**more, allow_abbrev=False)
        self.options: dict[str, argparse.Action] = {}
        self.places: list[argparse.Action] = []
        self.commands: Mapping[str, Parser] = {}

    def add_argument(self, *names: Any, **more: Any) -> argparse.Action:
        """Declare an option or a positional argument."""
        action = super().add_argument(*names, **more)
        if not hasattr(self, "options"):  # argparse itself declares --help
            return action
        if action.option_strings:
            self.options.update(dict.fromkeys(action.option_strings, action))
        else:
            self.places.append(action)
        return action

    def error(self, message: str) -> NoReturn:
        """Refuse an argument that `understood` should have refused."""
        raise QuadvisError(f"this is not understood; see '{self.prog} --help'")


def understood(parser: Parser, arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command, or of a tool; QuadvisError says which one is wrong, and why."""
    for argument in arguments:
        if "\0" in argument:
            raise QuadvisError(f"{quoted(argument)} holds a character that no name and no value can have")
    if not parser.commands:
        return parser.parse_args(_checked(parser, arguments))
    for index, word in enumerate(arguments):
        if word in HELP or word in parser.options:
            break
        if word.startswith("-"):
            raise QuadvisError(
                f"there is no option {quoted(word)} before a command; see '{parser.prog} --help'"
            )
        if word not in parser.commands:
            remedy = suggestion(word, parser.commands) or f"see '{parser.prog} --help'"
            raise QuadvisError(f"there is no command {quoted(word)}; {remedy}")
        rest = _checked(parser.commands[word], arguments[index + 1 :])
        return parser.parse_args([*arguments[: index + 1], *rest])
    if not arguments:
        raise QuadvisError(f"name a command: {', '.join(parser.commands)}; see '{parser.prog} --help'")
    return parser.parse_args(arguments)


def _checked(parser: Parser, words: Sequence[str]) -> list[str]:
    """Return the words with each value joined to its option, so that it may begin with '-'."""
    found: list[str] = []
    placed: list[str] = []
    waiting = list(words)
    ended = False  # True after '--', where words are never options
    while waiting:
        word = waiting.pop(0)
        if not ended and word in HELP:
            return [word]
        if ended or not word.startswith("-") or word == "-":
            placed.append(word)
        elif word == "--":
            ended = True
        else:
            found += _option(parser, word, waiting)
    needed = [place for place in parser.places if place.nargs in (None, "+")]
    further = [place for place in parser.places if place.nargs == "?"]
    further += [place for place in parser.places if place.nargs in ("*", "+")] * (len(placed) - len(needed))
    for place, word in zip([*needed, *further], placed, strict=False):
        _check_choice(place, _name(place), word)
        _check_value(place, _name(place), word)
    given = {word.partition("=")[0] for word in found}
    lacking = [
        *(_name(place) for place in needed[len(placed) :]),
        *(name for name, each in parser.options.items() if each.required and name not in given),
    ]
    if lacking:
        missing = " and ".join(lacking)
        raise QuadvisError(f"{missing} is missing; write {_usage(parser)}")
    if len(placed) > len(needed) + len(further):
        raise QuadvisError(
            f"{quoted(placed[len(needed) + len(further)])} is one too many; write {_usage(parser)}"
        )
    return [*found, "--", *placed] if placed else found


def _option(parser: Parser, word: str, waiting: list[str]) -> list[str]:
    """Return an option as one word; take its value from the waiting words."""
    name, equals, value = word.partition("=")
    if not word.startswith("--") and word[:2] in parser.options:
        name, equals, value = word[:2], word[2:3], word[2:].removeprefix("=")
    action = parser.options.get(name)
    if action is None:
        remedy = suggestion(name, [option for option in parser.options if option.startswith("--")])
        remedy = remedy or f"see '{parser.prog} --help'"
        raise QuadvisError(f"there is no option {quoted(name)}; {remedy}")
    if action.nargs == 0:
        if equals:
            raise QuadvisError(f"{name} takes no value; leave {quoted(value)} out")
        return [name]
    if isinstance(action.nargs, int):
        values = [value] if equals else []
        while len(values) < action.nargs and waiting and not waiting[0].startswith("-"):
            values.append(waiting.pop(0))
        if len(values) < action.nargs:
            raise QuadvisError(f"{name} needs {action.nargs} values; write {name} {_name(action)}")
        return [action.option_strings[0], *values]
    if not equals and waiting and waiting[0].partition("=")[0] not in (*HELP, *parser.options):
        equals, value = "=", waiting.pop(0)
    if not equals or value == "--":
        raise QuadvisError(f"{name} needs a value; write {name} {_name(action)}")
    _check_value(action, name, value)
    _check_choice(action, name, value)
    return [f"{action.option_strings[0]}={value}"]


def _check_choice(action: argparse.Action, name: str, value: str) -> None:
    """Refuse what is none of the values that an argument has, if they are listed."""
    if action.choices is None:
        return
    named = [str(each) for each in action.choices]
    if value not in named:
        remedy = suggestion(value, named) or f"choose from {', '.join(map(quoted, named))}"
        raise QuadvisError(sentence(f"{name} cannot be {quoted(value)}", remedy))


def _check_value(action: argparse.Action, name: str, value: str) -> None:
    """Refuse a value that an argument does not take; ArgumentTypeError of its type is what is wrong."""
    example = f"; write {name} {_name(action)}" if action.option_strings else ""
    try:
        if action.type is not None:
            action.type(value)  # type: ignore[operator]
    except argparse.ArgumentTypeError as error:
        raise QuadvisError(f"{name}: {error}{example}") from None
    except ValueError:
        kind, such = ("number", "0.5") if action.type is float else ("whole number", "3")
        raise QuadvisError(f"{name}: {quoted(value)} is not a {kind}; write one, such as {such}") from None


def _name(action: argparse.Action) -> str:
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    return action.metavar or action.dest.upper()


def _usage(parser: Parser) -> str:
    places = (
        "|".join(map(str, place.choices))
        if place.choices
        else _PLACES.get(place.nargs, "{}").format(_name(place))
        for place in parser.places
    )
    options = (f"{name} {_name(each)}" for name, each in parser.options.items() if each.required)
    return f"'{' '.join([parser.prog, *places, *options])}'"
