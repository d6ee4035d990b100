import numpy as np
import pytest

from quadvis.block.random import (
    M1,
    M2,
    fill_normal,
    fill_uniform,
    normal,
    normal_like,
    random_signs,
    uniform,
)


def stream(*state: int) -> np.ndarray:
    return np.array(state or [12345] * 6, np.int64)


def test_the_first_uniform_is_the_published_one() -> None:
    # L'Ecuyer, Simard, Chen, Kelton, An object-oriented random-number package, 2002: first of stream g1.
    assert uniform(stream()) == pytest.approx(0.127011122046577, abs=5e-16)


def test_a_thousand_steps_are_the_thousandth_power_of_the_recurrence() -> None:
    matrices = [[0, 1, 0], [0, 0, 1], [-810728, 1403580, 0]], [[0, 1, 0], [0, 0, 1], [-1370589, 0, 527612]]
    state = stream()
    for _ in range(1000):
        uniform(state)
    expected = []
    for matrix, modulus in zip(matrices, (M1, M2), strict=True):
        power, base, exponent = np.eye(3, dtype=object), np.array(matrix, dtype=object), 1000
        while exponent:
            if exponent & 1:
                power = power.dot(base) % modulus
            base, exponent = base.dot(base) % modulus, exponent >> 1
        expected += [int(value) % modulus for value in power.dot(np.array([12345] * 3, dtype=object))]
    assert state.tolist() == expected


@pytest.mark.parametrize("state", [(M1 - 1, M1 - 1, M1 - 1, M2 - 1, M2 - 1, M2 - 1), (1, 0, 0, 0, 0, 1)])
def test_extreme_states_stay_inside_the_open_interval(state: tuple[int, ...]) -> None:
    extreme = stream(*state)
    numbers = [uniform(extreme) for _ in range(200)]
    assert min(numbers) > 0.0 and max(numbers) < 1.0
    assert (extreme >= 0).all() and (extreme[:3] < M1).all() and (extreme[3:] < M2).all()


def test_uniforms_are_spread_evenly_and_not_correlated() -> None:
    state = stream()
    numbers = np.array([uniform(state) for _ in range(40000)])
    counts, _ = np.histogram(numbers, 20, (0.0, 1.0))
    assert ((counts - 2000) ** 2 / 2000).sum() < 43.8  # chi-square, 19 degrees of freedom, 99.9 %
    assert abs(np.corrcoef(numbers[1:], numbers[:-1])[0, 1]) < 4 / 200


@pytest.mark.parametrize("pairs", [False, True])
def test_normal_numbers_have_the_moments_of_a_normal_distribution(pairs: bool) -> None:
    state, numbers = stream(), np.empty(40000)
    if pairs:
        fill_normal(state, numbers)
    else:
        numbers[:] = [normal(state) for _ in range(numbers.size)]
    moments = [np.mean(numbers**power) for power in (1, 2, 3, 4)]
    errors = np.sqrt(np.array([1, 2, 15, 96]) / numbers.size)  # of each sample moment
    assert (np.abs(np.array(moments) - [0, 1, 0, 3]) < 4 * errors).all()
    assert np.mean(np.abs(numbers) < 1) == pytest.approx(0.6827, abs=0.01)
    assert abs(np.corrcoef(numbers[0::2], numbers[1::2])[0, 1]) < 4 / 140


def test_an_array_is_filled_in_the_shape_of_the_model_and_a_float_gives_a_float() -> None:
    assert normal_like(stream(), np.zeros((2, 3))).shape == (2, 3)
    assert len(set(normal_like(stream(), np.zeros(5)).tolist())) == 5
    assert isinstance(normal_like(stream(), 0.0), float)


def test_equal_states_give_equal_numbers() -> None:
    assert normal_like(stream(), np.zeros(7)).tolist() == normal_like(stream(), np.zeros(7)).tolist()


def test_an_array_of_uniform_numbers_holds_those_that_come_one_by_one() -> None:
    one_by_one, at_once, numbers = stream(1, 2, 3, 4, 5, 6), stream(1, 2, 3, 4, 5, 6), np.empty(7)
    fill_uniform(at_once, numbers)
    assert numbers.tolist() == [uniform(one_by_one) for _ in range(7)]
    assert at_once.tolist() == one_by_one.tolist()


def test_signs_are_fair_and_independent() -> None:
    signs = np.empty(10000)
    random_signs(stream(), signs)
    assert set(signs.tolist()) == {-1.0, 1.0}
    assert abs(signs.mean()) < 4 / 100
    assert abs(np.mean(signs[1:] * signs[:-1])) < 4 / 100
