"""Plain functions as machine code: kinds, shapes, refusals, the cache."""

import importlib.util
import linecache

import numpy as np
import pytest

from quadvis.block import Block, In, Out
from quadvis.native import cache
from quadvis.native.functions import compiled_as, load, native, prepare
from quadvis.native.library import library
from quadvis.testing import drive


def total_by_loops(values):
    total = 0.0
    for value in values:
        total += value
    return total


@compiled_as(total_by_loops)
def total(values):
    return float(sum(values.tolist(), 0.0))


@native(takes=("uint8[h,w]", "float64[n]", "float64"), gives=("float64[n]", "float64"))
def spread(picture, values, least):
    """Return the values, scaled, and the sum of the brightest pixel and of all values."""
    return values * (1.0 / max(least, 1.0)), float(picture.max()) + total(values)


@native(takes=("float64[n]",), gives=("float64",))
def inverse(values):
    return 1.0 / values[0]


TOGETHER = (spread, inverse)


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.FOLDER, str(tmp_path))
    yield tmp_path
    for function in TOGETHER:
        function.bind(None)


@pytest.mark.slow
def test_machine_code_gives_the_same_is_kept_and_is_loaded_again(fresh):
    picture, values = np.arange(12, dtype=np.uint8).reshape(3, 4), np.array([0.1, 0.2, 0.7])
    interpreted = spread(picture, values, 3.0)
    assert not load(TOGETHER) and not spread.is_native
    prepare(TOGETHER)
    assert spread.is_native and len(list(fresh.iterdir())) == 1
    for _ in range(2):
        compiled = spread(picture[:, ::1], values, 3.0)
        assert (compiled[0] == interpreted[0]).all() and compiled[1] == interpreted[1]
        assert spread(picture, values[:2], 3.0)[0].shape == (2,)
        for function in TOGETHER:
            function.bind(None)
        assert load(TOGETHER)


@pytest.mark.slow
def test_what_machine_code_refuses_is_pythons_to_say(fresh):
    prepare(TOGETHER)
    assert inverse(np.array([4.0])) == 0.25
    with pytest.warns(RuntimeWarning, match="divide by zero"):
        assert inverse(np.array([0.0])) == np.inf
    with pytest.raises(TypeError, match=r"spread takes float64\[n\], not an array of shape \(1, 1\)"):
        spread(np.zeros((2, 2), np.uint8), np.zeros((1, 1)), 1.0)


def test_kinds_are_declared_rightly():
    with pytest.raises(ValueError, match="no kind"):
        native(takes=("float[n]",), gives=())(total_by_loops)
    with pytest.raises(ValueError, match="gives sizes that it does not take"):
        native(takes=("float64",), gives=("float64[n]",))(total_by_loops)


class Looking(Block, numeric=False):
    """A block that calls plain functions with machine code."""

    functions = TOGETHER
    u = In()
    y = Out()

    def output(self, u):
        return inverse(np.array([u]))


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "engine", "compiled"), [(9, "native", True), (9, "auto", False)])
def test_a_run_by_machine_code_compiles_what_blocks_call_where_that_pays(fresh, steps, engine, compiled):
    assert drive(Looking(), u=np.full(steps, 4.0), engine=engine, rate="10 Hz").y == pytest.approx(0.25)
    assert inverse.is_native == compiled


def test_a_source_that_was_edited_is_refused_until_it_is_back(fresh, tmp_path):
    path = tmp_path / "edited_source.py"
    text = "def cube(x):\n    return x**3\n"
    path.write_text(text)
    spec = importlib.util.spec_from_file_location("edited_source", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function = native(takes=("float64",), gives=("float64",))(module.cube)
    path.write_text(text.replace("3", "4"))
    linecache.checkcache()
    library().compile_functions([function])
    assert not library().load_functions([function])  # nothing is kept of a refusal that passes
    path.write_text(text)
    linecache.checkcache()
    library().compile_functions([function])
    assert library().load_functions([function])
    assert function(2.0) == 8.0


@pytest.mark.slow
def test_a_slice_that_another_shape_is_given_needs_no_functions_of_texts():
    numba = pytest.importorskip("numba")
    from numba.np import arrayobj

    from quadvis.native.compiler import compile_function

    def moved(place):
        values = numba.carray(place, 3)
        values[: int(values[0])] = values[1:]

    refuse = arrayobj.raise_with_shape_context
    compiled = compile_function(moved, [numba.types.CPointer(numba.float64)])
    assert "moved" in compiled.text and "unicode" not in compiled.text
    assert arrayobj.raise_with_shape_context is refuse
