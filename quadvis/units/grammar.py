"""The grammar of units: "W/(m*K)" and "Hz^0.5" as powers of names."""

from __future__ import annotations

import re
from collections.abc import Container
from fractions import Fraction

from quadvis.errors import QuadvisError, quoted, sentence
from quadvis.units.names import NUMBERED, SPELLINGS

Powers = list[tuple[str, Fraction]]

LONGEST = 80
_GENERAL = "use m, s, rad, kg, N, V, Hz, px ..."
_TOKEN = re.compile(r"([abc]_[0-9]+|[A-Za-z%]+)|([0-9]+(?:\.[0-9]+)?)|([*/^()-])")
_RAISED = re.compile("\N{SUPERSCRIPT MINUS}([¹²³])")
_AROUND_OPERATOR = re.compile(r"\s*([*/^])\s*")


class UnitError(QuadvisError):
    """A text that is not a unit or not a quantity: the problem and the remedy."""

    def __init__(self, problem: str, remedy: str = "") -> None:
        """Keep both halves of the sentence separately, for messages that name a place."""
        self.problem, self.remedy = problem, remedy
        super().__init__(sentence(problem, remedy))


def plain_spelling(text: str) -> str:
    """Return the text in the spelling of the parser, without blanks around operators."""
    powers = _RAISED.sub(lambda match: f"^-{'¹²³'.index(match[1]) + 1}", text)
    return _AROUND_OPERATOR.sub(r"\1", powers.translate(SPELLINGS)).strip()


def read_powers(text: str, names: Container[str]) -> Powers:
    """Return the names in a unit, from left to right, each with its exponent; UnitError if it is none.

    The text has plain spelling; ``names`` are the names of all units.
    """
    return _Reader(text, names).powers()


class _Reader:
    """Reads one unit: factors joined by `*` and `/`, left to right, each with an optional `^` power."""

    def __init__(self, text: str, names: Container[str]) -> None:
        self.text, self.names = text, names
        self.tokens = self._split()
        self.at = 0

    def _split(self) -> list[str]:
        tokens, position = [], 0
        while position < len(self.text):
            match = _TOKEN.match(self.text, position)
            if match is None:
                wrong = quoted(self.text[position])
                raise UnitError(f"{quoted(self.text)} is not a unit", f"{wrong} is no part of one")
            tokens.append(match.group())
            position = match.end()
        return tokens

    def _next(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def _take(self) -> str:
        token = self._next()
        self.at += 1
        return token

    def powers(self) -> Powers:
        result = self._product()
        if self._next():
            raise self._fault(self.at)
        return result

    def _product(self) -> Powers:
        result = self._factor()
        while self._next() in ("*", "/"):
            sign = 1 if self._take() == "*" else -1
            result += _raised(self._factor(), sign)
        return result

    def _factor(self) -> Powers:
        token = self._take()
        if token == "(":
            result = self._product()
            if self._take() != ")":
                raise UnitError(f"{quoted(self.text)} lacks a ')'")
        elif token == "1":
            result = []
        elif token in self.names or NUMBERED in token:
            result = [(token, Fraction(1))]
        else:
            raise self._fault(self.at - 1)
        if self._next() == "^":
            self.at += 1
            result = _raised(result, self._exponent())
        return result

    def _exponent(self) -> Fraction:
        if self._next() != "(":
            return self._signed()
        self.at += 1
        result = self._signed()
        if self._next() == "/":
            self.at += 1
            below = self._signed()
            if not below:
                raise UnitError(f"{quoted(self.text)} divides by zero")
            result /= below
        if self._take() != ")":
            raise UnitError(f"{quoted(self.text)} lacks a ')'")
        return result

    def _signed(self) -> Fraction:
        sign = 1
        if self._next() == "-":
            self.at += 1
            sign = -1
        token = self._take()
        if not token[:1].isdigit() or len(token) > 5:
            raise UnitError(f"{quoted(self.text)} has no exponent after '^'", "write such as 's^2' or 's^-1'")
        return sign * Fraction(token)

    def _fault(self, position: int) -> UnitError:
        token = self.tokens[position] if position < len(self.tokens) else ""
        if token in ("", *"*/^()-"):
            missing = "a unit is missing at its end" if not token else f"'{token}' stands where it cannot"
            return UnitError(f"{quoted(self.text)} is not a unit", missing)
        if token[0].isdigit():
            return UnitError(f"{quoted(self.text)} is not a unit", f"leave out the number {token}")
        return UnitError(f"{quoted(token)} is not a unit", _GENERAL)


def _raised(powers: Powers, exponent: Fraction | int) -> Powers:
    return [(name, power * exponent) for name, power in powers]
