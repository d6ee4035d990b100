"""What every block must do, the standard library's and anybody else's: a suite of checks to run over a class.

check_block(Fan, given={"curve": "fan.csv"})  # all of it; AssertionError tells everything that is wrong

@pytest.mark.parametrize("name", CHECKS)      # or one by one
def test_fan(name):
    CHECKS[name](Subject(Fan, given={"curve": "fan.csv"}))
"""

from __future__ import annotations

import inspect
import sys
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from quadvis.block import METHODS, Block, Frame, Param, ParameterError
from quadvis.engine.compiled import Compiled, Compiler
from quadvis.engine.engine import Snapshot
from quadvis.engine.layout import TIME, Placed
from quadvis.engine.memory import Slot
from quadvis.errors import QuadvisError
from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, extreme_rigs, rigs

__all__ = ["CHECKS", "Subject", "check_block"]

# Compiled and interpreted agree to the last bit where both use the C library's functions and one order of
# summation. numba promises neither on every machine, so a few last bits are allowed.
TOLERANCE = 1e-12

HOSTILE = (1000.0, 0.7 * float(PERIOD), -1000.0, np.nan, np.inf, -np.inf)  # s, beside the right stamp
HOSTILE_AT = STEPS // 3  # the step at which it comes


def check_block(
    block: type[Block],
    *,
    given: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Sequence[Any]] | None = None,
    test: Path | None = None,
) -> None:
    """Run all checks over a block class; AssertionError tells everything that is wrong. See ``Subject``.

    Whether the block compiles is checked where numba is installed.
    """
    subject = Subject(block, given or {}, inputs or {}, test)
    problems = []
    for name, check in CHECKS.items():
        if check is compiles and find_spec("numba") is None:
            continue
        try:
            check(subject)
        except AssertionError as error:
            problems.append(f"{block.__name__}: {name}: {error}")
        except Exception as error:
            problems.append(f"{block.__name__}: {name}: {type(error).__name__}: {error}")
    if problems:
        raise AssertionError("\n".join(problems))


def one_block_in_its_module(subject: Subject) -> None:
    """Check that the module defines no other public block, and that its file is called as the class is."""
    module = sys.modules[subject.block.__module__]
    kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and issubclass(kind, Block)]
    own = {kind.__name__ for kind in kinds if kind.__module__ == module.__name__}
    public = sorted(name for name in own if not name.startswith("_"))
    assert public == [subject.block.__name__], f"the module defines {', '.join(public)}; move the others"
    file = Path(str(module.__file__)).stem
    wanted = "".join(part.capitalize() for part in file.split("_"))
    assert subject.block.__name__ == wanted, f"the class in {file}.py must be called {wanted}"


def documented(subject: Subject) -> None:
    """Check that the docstring begins with a sentence, and that every port and parameter says what it is."""
    first, _, rest = inspect.cleandoc(vars(subject.block).get("__doc__") or "").partition("\n")
    assert first.endswith("."), "the docstring's first line must be a sentence that ends in a full stop"
    assert not rest or rest.startswith("\n"), "the docstring's second line must be empty"
    interface = subject.block.interface
    declared = (*interface.inputs.values(), *interface.outputs.values(), *interface.params.values())
    bare = [item.name for item in declared if not item.doc]
    assert not bare, f"these need a doc: {', '.join(bare)}"


def tested(subject: Subject) -> None:
    """Check that there is a test file where one should be."""
    assert subject.test is None or subject.test.is_file(), f"there is no test at {subject.test}; write one"


def all_declarations_used(subject: Subject) -> None:
    """Check that every input is asked for, and every parameter and state named, by some method."""
    interface = subject.block.interface
    asked = {name for names in interface.arguments.values() for name in names}
    idle = [name for name in interface.inputs if name not in asked]
    assert not idle, f"no method asks for {', '.join(idle)}; take it away"
    classes = [kind for kind in subject.block.__mro__ if kind not in Block.__mro__]
    functions = [value for kind in classes for value in vars(kind).values() if inspect.isfunction(value)]
    names = {name for function in functions for name in _names(inspect.unwrap(function).__code__)}
    idle = [name for name in (*interface.params, *interface.states) if name not in names]
    assert not idle, f"no method uses {', '.join(idle)}; take it away"


def _names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
        elif isinstance(constant, str) and "read_file" in code.co_names:  # read_file("calibration", ...)
            yield constant


def refuses_bad_parameters(subject: Subject) -> None:
    """Check that a value beyond a bound, of another kind or missing is refused with the house's sentence."""
    subject.make()
    for name, param in subject.block.interface.params.items():
        for value in _bad_values(param):
            refusal = _refusal(subject, name, value)
            assert refusal is not None, f"{name} = {value!r} must be refused with ParameterError"
            named = refusal.parameter == name and str(refusal).startswith(f"{name} must be")
            assert named, f"for {name} = {value!r} say '{name} must be ...', not '{refusal}'"
        if param.required:
            others = {other: value for other, value in subject.given.items() if other != name}
            assert _refusal(Subject(subject.block, others), name, None), f"a missing {name} must be refused"
    assert _refusal(subject, "no_such_parameter", 1.0), "an unknown parameter must be refused"


def _refusal(subject: Subject, name: str, value: Any) -> ParameterError | None:
    try:
        subject.make(**{name: value})
    except ParameterError as error:
        return error
    return None


def _bad_values(param: Param) -> Iterator[Any]:
    yield 1.0 if param.is_text else "no such choice"
    if param.is_text or param.choices:
        return
    shape = param.signal.resolve({})
    if param.signal.shape != ("*",):
        yield np.zeros((*shape, 2, 2)).tolist()
    numbers = [np.nan, *(bound for bound in (param.above, param.below) if bound is not None)]
    for bound, beyond in ((param.min, -np.inf), (param.max, np.inf)):
        if bound is not None:
            whole = param.signal.scalar == "int64"
            numbers.append(bound + np.sign(beyond) if whole else float(np.nextafter(bound, beyond)))
    for number in numbers:
        yield np.full(shape, number).tolist()


def refuses_before_a_run(subject: Subject) -> None:
    """Check that ``open`` and ``start`` refuse no parameter: ``quadvis check`` does not call them."""
    for name, value, rig in extreme_rigs(subject):
        try:
            with rig.engine:
                pass
        except QuadvisError as error:
            found = f"{name} = {value!r} stops a run before its first tick ({error})"
            raise AssertionError(f"{found}; refuse it in check or check_period") from None


def starts_the_same(subject: Subject) -> None:
    """Check that ``start`` gives the same states whatever ran before it."""
    for rig, again in zip(rigs(subject), rigs(subject), strict=True):
        initial = rig.engine.snapshot()
        with rig.engine, again.engine:
            started = rig.record()
            assert again.record() == started, "two blocks with the same seed start differently"
            rig.run(range(STEPS))
            rig.engine.restore(initial)
            if "start" in subject.block.interface.arguments:
                rig.block.start()
            assert rig.record() == started, "start after a run gives other states; keep nothing in attributes"


def output_changes_nothing(subject: Subject) -> None:
    """Check that ``output`` called twice gives the same, and leaves parameters and states alone."""
    for rig in rigs(subject):
        output = rig.call("output")
        if output is None:
            continue
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                before = rig.record()
                output()
                first = rig.contents()
                output()
                assert rig.record() == before, f"output changed a state at step {step}; only update may"
                assert rig.contents() == first, f"output gave two answers at step {step}"
                rig.engine.run(1)


def inputs_not_asked_for_do_not_matter(subject: Subject) -> None:
    """Check that what ``output`` gives depends on the inputs that it asks for alone."""
    others = set(subject.block.interface.inputs) - subject.block.interface.feedthrough
    for rig in rigs(subject):
        output, memory = rig.call("output"), rig.memory
        if output is None or not others:
            continue
        with rig.engine:
            for step in range(1, STEPS):
                rig.feed(step)
                for name in others:
                    memory.write(rig.placed.inputs[name], rig.series[step - 1][name])
                output()
                rig.feed(step)
                first = rig.contents()
                output()
                assert rig.contents() == first, f"output saw one of {', '.join(others)}; ask for it by name"
                rig.engine.run(1)


def repeats_after_restore(subject: Subject) -> None:
    """Check that a run from a snapshot repeats to the bit, in the same engine and in a fresh one."""
    half = STEPS // 2
    for rig, fresh in zip(rigs(subject), rigs(subject), strict=True):
        with rig.engine:
            rig.run(range(half))
            snapshot = rig.engine.snapshot()
            first = rig.run(range(half, STEPS))
            _repeats(rig, snapshot, first, "the same engine")
        with fresh.engine:  # not before the other is closed: a file is written by one of them at a time
            _repeats(fresh, snapshot, first, "a fresh engine")


def _repeats(rig: Rig, snapshot: Snapshot, first: list[tuple[Any, ...]], words: str) -> None:
    rig.engine.restore(snapshot)
    same = rig.run(range(STEPS - len(first), STEPS)) == first
    assert same, f"restored in {words} it gives something else; keep in states what matters"


def outlives_hostile_stamps(subject: Subject) -> None:
    """Check that a stamp that cannot be is as good as one that repeats, and that later good ones count.

    Stamps are the inputs called ``stamp`` or ``..._stamp``. One of them is ahead of the time, from long ago,
    NaN or infinite. From two samples later on the block must give the floats and flags that it gives when
    that stamp repeats the one before, since neither is news; counts and codes may tell the two apart.
    """
    names = [
        name
        for name, port in subject.block.interface.inputs.items()
        if (name == "stamp" or name.endswith("_stamp")) and str(port.signal) == "float64"
    ]
    for hostile in HOSTILE if names else ():
        for rig, other in zip(rigs(subject), rigs(subject), strict=True):
            spoilt = _stamped(rig, names, _good(HOSTILE_AT) + hostile)
            repeated = _stamped(other, names, _good(HOSTILE_AT - 1))
            for step, (found, wanted) in enumerate(zip(spoilt, repeated, strict=True)):
                if step < HOSTILE_AT + 2:
                    continue
                for name, value in wanted.items():
                    same = np.array_equal(found[name], value, equal_nan=True)
                    words = (
                        f"{step - HOSTILE_AT} samples after a stamp {_told(hostile)} {name} is {found[name]}"
                    )
                    assert same, f"{words}, not {value} as if that stamp were no news; it must not count"


def _good(step: int) -> float:
    """Return the stamp of what comes at a step, half a period old."""
    return float((step - Fraction(1, 2)) * PERIOD)


def _told(hostile: float) -> str:
    if not np.isfinite(hostile):
        return f"of {hostile}"
    return f"{abs(hostile):g} s {'ahead' if hostile > 0.0 else 'back'}"


def _stamped(rig: Rig, names: Sequence[str], stamp: float) -> list[dict[str, Any]]:
    """Run a block on good stamps but one; return its floats and flags at each step."""
    found = []
    memory, outputs = rig.memory, rig.placed.outputs
    slots = {name: slot for name, slot in outputs.items() if slot.scalar in ("float64", "bool")}
    with rig.engine:
        for step in range(STEPS):
            rig.series[step].update(dict.fromkeys(names, stamp if step == HOSTILE_AT else _good(step)))
            rig.feed(step)
            rig.engine.run(1)
            found.append({name: memory.read(slot) for name, slot in slots.items()})
    return found


def returns_what_it_declares(subject: Subject) -> None:
    """Check that the methods return the declared number of values, of the declared kind and shape."""
    for rig in rigs(subject):
        placed, memory = rig.placed, rig.memory
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                for method, names in subject.block.interface.arguments.items():
                    slots = _targets(placed, method)
                    if slots:
                        arguments = [memory.read(slot) for slot in _sources(placed, names)]
                        _declared(method, getattr(rig.block, method)(*arguments), slots)
                rig.engine.run(1)


def _sources(placed: Placed, names: Sequence[str]) -> list[Slot]:
    return [TIME if name == "time" else placed.inputs[name] for name in names]


def _targets(placed: Placed, method: str) -> Mapping[str, Slot]:
    return {"output": placed.outputs, "deriv": placed.slopes}.get(method, {})


def _declared(method: str, returned: Any, slots: Mapping[str, Slot]) -> None:
    values = (returned,) if len(slots) == 1 else returned
    right = isinstance(values, tuple) and len(values) == len(slots)
    assert right, f"{method} must return {len(slots)} values, it returned {returned!r}"
    for value, (name, slot) in zip(values, slots.items(), strict=True):
        if slot.scalar == "frame":
            assert isinstance(value, Frame), f"{method} must return a Frame for {name}, not {value!r}"
            continue
        kinds = {"float64": "fiub", "int64": "iu", "bool": "b"}[slot.scalar]
        found = np.asarray(value)
        right = found.shape == slot.shape and found.dtype.kind in kinds
        wanted = f"{slot.scalar} of shape {slot.shape}" if slot.shape else slot.scalar
        assert right, f"{method} must return {wanted} for {name}, not {value!r}"


def compiles(subject: Subject) -> None:
    """Check that every method of a numeric block, compiled, agrees with the interpreted one.

    Over random inputs, some of them NaN, and random parameters; both start from the same memory at every
    call, so that errors do not add up. Whole numbers agree exactly, floats to ``TOLERANCE``, absolute and
    relative.
    """
    if not subject.block.numeric:
        return
    known: dict[Any, dict[str, Compiled]] = {}
    for rig in rigs(subject, missing=True):
        placed = rig.placed
        shapes = tuple(slot.shape for slot in (*placed.inputs.values(), *placed.outputs.values()))
        compiled = known.get((placed.record, shapes)) or _compile(subject.block, placed)
        known[placed.record, shapes] = compiled
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                _agree(rig, compiled, step)


def _compile(block: type[Block], placed: Placed) -> dict[str, Compiled]:
    compiler = Compiler(block, placed.record)
    return {
        method: compiler.compile(method, _sources(placed, names), list(_targets(placed, method).values()))
        for method, names in block.interface.arguments.items()
    }


def _agree(rig: Rig, compiled: Mapping[str, Compiled], step: int) -> None:
    """Call every method both ways; then take an Euler step, to reach another state."""
    program, memory = rig.engine.program, rig.memory
    memory.write(TIME, float(step * PERIOD))
    for method in METHODS:
        call = getattr(rig.block, "start", None) if method == "start" else rig.call(method)
        if call is None or (method == "start" and step > 0):
            continue
        before = rig.engine.snapshot()
        try:
            call()
        except (ArithmeticError, ValueError):
            # What is an error when interpreted stops a run: there is no result to agree with.
            rig.engine.restore(before)
            continue
        interpreted = rig.engine.snapshot()
        rig.engine.restore(before)
        compiled[method](memory, rig.placed.position)
        _same(rig, interpreted, f"{method} at step {step}")
    memory.floats[list(program.states)] += float(PERIOD) * memory.floats[list(program.slopes)]


def _same(rig: Rig, interpreted: Snapshot, where: str) -> None:
    placed, memory = rig.placed, rig.memory
    slots = {item.name: placed.field(item.name) for item in placed.record.fields}
    slots |= placed.outputs | {f"the derivative of {name}": slot for name, slot in placed.slopes.items()}
    compiled = {name: memory.read(slot) for name, slot in slots.items()}
    rig.engine.restore(interpreted)
    for name, slot in slots.items():
        wanted = memory.read(slot)
        tolerance = TOLERANCE if slot.scalar == "float64" else 0.0
        same = np.allclose(compiled[name], wanted, rtol=tolerance, atol=tolerance, equal_nan=True)
        assert same, f"{where}: {name} is {wanted} interpreted, {compiled[name]} compiled"


CHECKS: dict[str, Callable[[Subject], None]] = {
    check.__name__: check
    for check in (
        one_block_in_its_module,
        documented,
        tested,
        all_declarations_used,
        refuses_bad_parameters,
        refuses_before_a_run,
        starts_the_same,
        output_changes_nothing,
        inputs_not_asked_for_do_not_matter,
        repeats_after_restore,
        outlives_hostile_stamps,
        returns_what_it_declares,
        compiles,
    )
}
