"""Kinds and units of expressions: which names are numbers or truth values, and in what units.

Each name that is a number has a unit variable. Sums, comparisons and functions ask for equal units; each such
equation determines one variable, or is a fault. So the ports of a block follow from its expressions, and the
checks of the diagram compare them with the wires.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

from quadvis.units import Unit, UnitError
from quadvis.units.arithmetic import Value, evaluate
from quadvis.units.expression import COMPARISONS, Call, Number, Symbol, Tree, names_of

ONE, RADIAN, SECOND = Unit(), Unit.parse("rad"), Unit.parse("s")
TIME = "time"
ANGLES, ARCS = ("sin", "cos", "tan"), ("asin", "acos", "atan")
PLAIN = ("sinh", "cosh", "tanh", "exp", "log", "log10", "floor", "ceil", "round", "fix")
LOGIC = (*COMPARISONS, "and", "or", "not")


class Kinds:
    """What the names of some expressions are; ``truths`` are those that are truth values."""

    def __init__(self, names: Iterable[str], trees: Mapping[str, Tree]) -> None:
        """Find the kinds and units of names and results; UnitError if they contradict each other."""
        self.trees = trees
        self.truths = {name for tree in trees.values() for name in _used_as_truth(tree, trees)}
        self._variables = {name: Unit.parse(f"a_{index}") for index, name in enumerate(names)}
        self._variables[TIME] = SECOND
        self._bindings: dict[str, Unit] = {}
        self._results: dict[str, Unit | None] = {}
        for name in trees:
            self._result(name)

    def is_truth(self, name: str) -> bool:
        """Say whether a name, or the result of this name, is a truth value."""
        return name in self.truths or (name in self.trees and self.gives_truth(self.trees[name]))

    def gives_truth(self, tree: Tree) -> bool:
        """Say whether an expression gives a truth value."""
        if isinstance(tree, Symbol):
            return self.is_truth(tree.text)
        if isinstance(tree, Number):
            return False
        return tree.function in LOGIC or (tree.function == "if" and self.gives_truth(tree.arguments[1]))

    def unit(self, name: str) -> Unit:
        """Return the unit of a name or of a result, with the variables that stay open."""
        found = self._results.get(name, self._variables.get(name))
        return self._bound(found) if found is not None else ONE

    def _bound(self, unit: Unit) -> Unit:
        while unit.variables & self._bindings.keys():
            unit = unit.substitute(self._bindings)
        return unit

    def _result(self, name: str) -> Unit | None:
        if name not in self._results:
            self._results[name] = None
            self._results[name] = self.of(self.trees[name])
        return self._results[name]

    def _equal(self, function: str, one: Unit | None, other: Unit | None) -> Unit | None:
        """Make two units equal; None is that of 0, which fits any."""
        if one is None or other is None:
            return one if other is None else other
        quotient = self._bound(one / other)
        if not quotient.variables:
            if quotient.dimension:
                first, second = (_text(self._bound(unit)) for unit in (one, other))
                raise UnitError(f"'{function}' joins {first} and {second}", "give both the same unit")
            return one
        variable = max(quotient.variables)
        exponent = dict(quotient.exponents)[variable]
        rest = quotient.substitute({variable: ONE})
        self._bindings[variable] = rest ** (-1 / exponent)
        return one

    def of(self, tree: Tree) -> Unit | None:
        """Return the unit of an expression; None for 0 and for truth values."""
        if isinstance(tree, Number):
            return None if tree.value == 0 and not tree.unit.dimension else Unit(tree.unit.dimension).si
        if isinstance(tree, Symbol):
            if tree.text in self.trees:
                return self._result(tree.text)
            return None if tree.text in self.truths else self._variables[tree.text]
        return self._of_call(tree)

    def _of_call(self, tree: Call) -> Unit | None:
        function = tree.function
        self._check_truths(tree)
        if function == "^":
            return self._of_power(*tree.arguments)
        units = [self.of(argument) for argument in tree.arguments]
        if function in ("*", "/"):
            one, other = (unit or ONE for unit in units)
            return one * other if function == "*" else one / other
        if function in ("and", "or", "not"):
            return None
        if function in ANGLES:
            self._equal(function, units[0], RADIAN)
            return ONE
        if function in (*ARCS, *PLAIN):
            self._equal(function, units[0], ONE)
            return RADIAN if function in ARCS else ONE
        if function in ("neg", "abs"):
            return units[0]
        if function in ("sqrt", "sign"):
            return (units[0] or ONE) ** Fraction(1, 2) if function == "sqrt" else ONE
        common = units[-1]
        for unit in units[1:-1] if function == "if" else units[:-1]:
            common = self._equal(function, unit, common)
        return RADIAN if function == "atan2" else None if function in COMPARISONS else common

    def _of_power(self, base: Tree, exponent: Tree) -> Unit | None:
        unit = self.of(base)
        power = constant(exponent)
        if power is None or not isinstance(power, Fraction):
            for each in (unit, self.of(exponent)):
                self._equal("^", each, ONE)
            return ONE
        return (unit or ONE) ** power

    def _check_truths(self, tree: Call) -> None:
        """Refuse truth values where numbers belong, and numbers where truth values do."""
        for index, argument in enumerate(tree.arguments):
            wanted = tree.function in ("and", "or", "not") or (tree.function == "if" and index == 0)
            found = self.gives_truth(argument)
            if tree.function == "if" and index:
                wanted = self.gives_truth(tree.arguments[1])
            if wanted and not found:
                remedy = "compare it, as in 'u > 0'"
                raise UnitError(f"'{tree.function}' takes a truth value, and gets a number", remedy)
            if found and not wanted:
                remedy = "choose numbers, as in 'if(on, 1, 0)'"
                raise UnitError(f"'{tree.function}' takes a number, and gets a truth value", remedy)


def constant(tree: Tree) -> Fraction | float | None:
    """Return the SI value of an expression without names; None if it has some."""
    if any(True for _ in names_of(tree)) or _is_logical(tree):
        return None
    found = evaluate(tree, lambda name: Value(Fraction(0)))
    assert isinstance(found, Value)
    return found.si.number


def _is_logical(tree: Tree) -> bool:
    if not isinstance(tree, Call):
        return False
    return tree.function in (*LOGIC, "if") or any(map(_is_logical, tree.arguments))


def _used_as_truth(tree: Tree, trees: Mapping[str, Tree]) -> set[str]:
    """Return the names that stand where a truth value belongs."""
    if not isinstance(tree, Call):
        return set()
    found = {name for argument in tree.arguments for name in _used_as_truth(argument, trees)}
    places = tree.arguments if tree.function in ("and", "or", "not") else ()
    places = tree.arguments[:1] if tree.function == "if" else places
    return found | {each.text for each in places if isinstance(each, Symbol) and each.text not in trees}


def _text(unit: Unit) -> str:
    return "a plain number" if not unit.dimension else str(unit.reduced)
