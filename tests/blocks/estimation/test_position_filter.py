import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_discrete_are
from scipy.stats import chi2

from quadvis.native.functions import native, prepare
from quadvis.testing import Driven, drive
from quadvis_blocks.estimation._chain import predict
from quadvis_blocks.estimation.position_filter import PositionFilter
from tests.stages import mostly_slow

STEP = 0.05
RATE = "20 Hz"
NOISE, WHITE, WANDER, DECAY = 0.02, 0.05, 0.3, 40.0
START = (0.5, 0.4)
MODEL: dict[str, Any] = {
    "noise": (NOISE,) * 3, "acceleration_noise": (WHITE,) * 3, "wander": (WANDER,) * 3, "decay": (DECAY,) * 3,
    "initial_sigma": START,
}  # fmt: skip


def chain(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and process noise of the chain over a step, by Van Loan's matrix exponential."""
    rates = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1 / DECAY]])
    density = np.diag([0.0, WHITE**2, 2 * WANDER**2 / DECAY])
    both = expm(step * np.block([[-rates, density], [np.zeros((3, 3)), rates.T]]))
    transition = both[3:, 3:].T
    return transition, transition @ both[:3, 3:]


def flight(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """True states (count, 3 axes, 3) and known accelerations (count, 3), straight between ticks."""
    rng = np.random.default_rng(seed)
    transition, noise = chain(STEP)
    root = np.linalg.cholesky(noise)
    known = rng.normal(0.0, 0.5, (count, 3))
    states = np.zeros((count, 3, 3))
    states[0] = rng.normal(size=(3, 3)) * (*START, WANDER)
    for k in range(count - 1):
        first, last = known[k], known[k + 1]
        pushed = np.stack((STEP**2 * (2 * first + last) / 6, STEP * (first + last) / 2, 0 * first), axis=1)
        states[k + 1] = states[k] @ transition.T + pushed + rng.normal(size=(3, 3)) @ root.T
    return states, known


def frames(states: np.ndarray, latency: int, every: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """What comes in at each tick: position (count, 3) and stamp (count,), held from frame to frame."""
    rng = np.random.default_rng([seed, 1])
    count = len(states)
    position, stamp = np.full((count, 3), np.nan), np.full(count, np.nan)
    for k in range(0, count - latency, every):
        position[k + latency : k + latency + every] = states[k, :, 0] + NOISE * rng.normal(size=3)
        stamp[k + latency : k + latency + every] = STEP * k
    return position, stamp


def estimate(known: Any, position: Any, stamp: Any, **parameters: Any) -> Driven:
    block = PositionFilter(**{**MODEL, **parameters})
    return drive(block, acceleration=known, position=position, stamp=stamp, rate=RATE)


def batch(known: np.ndarray, position: np.ndarray, stamps: np.ndarray, axis: int) -> tuple[Any, Any]:
    """Mean and covariance of the last state given all frames, as one Gaussian over all ticks."""
    count = len(known)
    transition, noise = chain(STEP)
    lower = np.eye(3 * count)  # from the noise of each step to all states
    mean = np.zeros(3 * count)
    for k in range(1, count):
        rows, before = slice(3 * k, 3 * k + 3), slice(3 * k - 3, 3 * k)
        lower[rows, : 3 * k] = transition @ lower[before, : 3 * k]
        first, last = known[k - 1, axis], known[k, axis]
        pushed = [STEP**2 * (2 * first + last) / 6, STEP * (first + last) / 2, 0.0]
        mean[rows] = transition @ mean[before] + pushed
    start = np.diag([START[0] ** 2, START[1] ** 2, WANDER**2])
    prior = lower @ block_diag(start, *[noise] * (count - 1)) @ lower.T
    seen = np.zeros((len(stamps), 3 * count))
    seen[np.arange(len(stamps)), 3 * np.round(stamps / STEP).astype(int)] = 1.0
    gain = prior @ seen.T @ np.linalg.inv(seen @ prior @ seen.T + NOISE**2 * np.eye(len(stamps)))
    mean = mean + gain @ (position[:, axis] - seen @ mean)
    return mean[-3:], (prior - gain @ seen @ prior)[-3:, -3:]


def last(result: Driven, axis: int) -> np.ndarray:
    return np.array([result.estimate[-1, axis], result.velocity[-1, axis], result.disturbance[-1, axis]])


def test_in_the_long_run_its_covariance_is_that_of_the_algebraic_riccati_equation() -> None:
    states, known = flight(1, 400)
    position, stamp = frames(states, latency=0, every=1, seed=1)
    result = estimate(known, position, stamp, contact=-100.0)
    transition, noise = chain(STEP)
    sight = np.array([[1.0, 0.0, 0.0]])
    prior = solve_discrete_are(transition.T, sight.T, noise, np.array([[NOISE**2]]))
    posterior = prior - prior @ sight.T @ sight @ prior / (prior[0, 0] + NOISE**2)
    for axis in range(3):
        assert result.covariance[-1, axis] == pytest.approx(posterior, rel=2e-3)


def test_late_frames_give_the_estimate_of_one_great_least_squares() -> None:
    states, known = flight(2, 60)
    position, stamp = frames(states, latency=7, every=2, seed=2)
    result = estimate(known, position, stamp)
    # The first frame comes with the tick at which the block begins to look back.
    new = np.flatnonzero(np.diff(stamp, prepend=np.nan) != 0)
    new = new[~np.isnan(stamp[new])]
    for axis in range(3):
        mean, covariance = batch(known, position[new], stamp[new], axis)
        assert last(result, axis) == pytest.approx(mean, abs=2e-4)
        assert result.covariance[-1, axis] == pytest.approx(covariance, rel=2e-3, abs=1e-7)


def test_frames_out_of_order_give_what_they_would_have_given_in_order() -> None:
    states, known = flight(3, 80)
    rng = np.random.default_rng(3)
    position, stamp = frames(states, latency=5, every=1, seed=3)
    shuffled = np.arange(80)
    for begin in range(20, 70, 5):
        shuffled[begin : begin + 5] = rng.permutation(shuffled[begin : begin + 5])
    one = estimate(known, position, stamp)
    other = estimate(known, position[shuffled], stamp[shuffled])
    assert other.refused[-1] == 0 and not np.array_equal(one.estimate[30:40], other.estimate[30:40])
    for name in ("estimate", "velocity", "disturbance", "covariance"):
        assert one.signals[name][-1] == pytest.approx(other.signals[name][-1], abs=1e-12)


def test_a_stamp_between_ticks_counts_for_its_instant() -> None:
    # A steady climb at 2 m/s, exact stamps in between, no process noise to speak of: the line is found.
    times = STEP * np.arange(100)
    stamp = times - 0.0317
    position = np.column_stack((2.0 * stamp, 0.0 * stamp, 1.0 + 0.0 * stamp))
    result = estimate(
        np.zeros(3), position, stamp, noise=(1e-4,) * 3, acceleration_noise=(0.0,) * 3, wander=(1e-6,) * 3,
        initial_sigma=(10.0, 10.0),
    )  # fmt: skip
    assert result.estimate[-1] == pytest.approx([2.0 * times[-1], 0.0, 1.0], abs=1e-4)
    assert result.velocity[-1] == pytest.approx([2.0, 0.0, 0.0], abs=1e-4)


@pytest.fixture(scope="module", params=mostly_slow([20, 60]))
def runs(request: pytest.FixtureRequest) -> list[tuple[np.ndarray, Driven]]:
    """Flights drawn from the filter's own model, with frames at 10 Hz and 0.15 s late."""
    found = []
    for seed in range(request.param):
        states, known = flight(100 + seed, 80)
        position, stamp = frames(states, latency=3, every=2, seed=100 + seed)
        found.append((states, estimate(known, position, stamp)))
    return found


def test_its_errors_are_as_large_as_its_covariance_says(runs: list[tuple[np.ndarray, Driven]]) -> None:
    # NEES: each axis of each run has three degrees of freedom, and axes and runs are independent.
    for tick in (0, 2, 10, 40, 79):
        total = 0.0
        for states, result in runs:
            found = np.stack([result.estimate[tick], result.velocity[tick], result.disturbance[tick]], axis=1)
            for off, covariance in zip(found - states[tick], result.covariance[tick], strict=True):
                total += off @ np.linalg.solve(covariance, off)
        low, high = chi2.ppf([0.0005, 0.9995], 9 * len(runs))
        assert low < total < high


def test_its_innovations_are_as_large_as_it_expects(runs: list[tuple[np.ndarray, Driven]]) -> None:
    nis = np.concatenate([result.nis[np.isfinite(result.nis)] for _, result in runs])
    assert len(nis) == 39 * len(runs)  # 39 frames reach the 80 ticks
    low, high = chi2.ppf([0.0005, 0.9995], 3 * len(nis))
    assert low < nis.sum() < high
    assert np.mean(nis > chi2.ppf(0.95, 3)) == pytest.approx(0.05, abs=4 * math.sqrt(0.05 / len(nis)))


def test_a_covariance_too_small_is_told_by_the_same_sum(runs: list[tuple[np.ndarray, Driven]]) -> None:
    states, known = flight(100, 80)
    position, stamp = frames(states, latency=3, every=2, seed=100)
    nis = estimate(known, position, stamp, noise=(NOISE / 3,) * 3).nis
    assert np.nansum(nis) > chi2.ppf(0.9999, 3 * np.isfinite(nis).sum())


def test_without_frames_it_goes_on_by_the_accelerations() -> None:
    times = STEP * np.arange(200)
    known = np.column_stack((np.cos(times), 0 * times, 0 * times))
    seen = times <= 2.0
    truth = 1 - np.cos(times)
    position = np.column_stack((truth, 0 * times, 0 * times))
    position[~seen] = np.nan
    result = estimate(known, position, np.where(seen, times, np.nan), noise=(1e-3,) * 3, wander=(1e-3,) * 3)
    assert np.abs(result.estimate[:, 0] - truth)[40:100].max() < 0.02
    assert (np.diff(result.covariance[50:, 0, 0, 0]) > 0).all()
    assert result.age[-1] == pytest.approx(times[-1] - 2.0)
    assert result.ok.tolist() == [bool(0 < age <= 4.0 + 1e-9) for age in times]


def test_one_wrong_frame_is_refused_and_counted() -> None:
    times = STEP * np.arange(100)
    position = np.zeros((100, 3))
    position[60, 1] = 1.0
    result = estimate(np.zeros(3), position, times)
    assert result.refused.tolist() == [0] * 60 + [1] * 40
    assert np.abs(result.estimate[61:]).max() < 1e-3
    assert result.nis[60] > 25.0


def test_a_tolerance_lets_pass_what_the_model_leaves_out() -> None:
    times = STEP * np.arange(100)
    position = np.zeros((100, 3))
    position[60:62] = [[0.0, 0.3, 0.0], [0.0, 1.0, 0.0]]
    result = estimate(np.zeros(3), position, times, tolerance=0.3)
    assert result.refused.tolist() == [0] * 61 + [1] * 39
    assert result.nis[60] > 25.0


LOOSE: dict[str, Any] = {
    "acceleration_noise": (0.5,) * 3, "wander": (1.0,) * 3, "noise": (1e-3,) * 3, "initial": (0.0, 0.0, 2.0),
}  # fmt: skip


def test_a_reach_refuses_after_a_gap_what_the_gate_of_a_loose_model_lets_pass() -> None:
    times = STEP * np.arange(120)
    position = np.where(times[:, None] < 3.5, [0.0, 0.0, 2.0], [0.4, 0.0, 2.0])
    stamp = np.where((times >= 3.0) & (times < 3.5), 3.0 - STEP, times)  # no frames for half a second
    believed = estimate(np.zeros(3), position, stamp, **LOOSE)
    assert believed.refused[70] == 0 and believed.velocity[70, 0] > 0.5  # of a craft that stands
    found = estimate(np.zeros(3), position, stamp, **LOOSE, reach=(0.2, 0.1, 0.3), reset_after=0.3)
    assert found.refused[-1] == 6 and np.abs(found.estimate[:76, 0]).max() < 1e-9
    assert found.estimate[76:] == pytest.approx(np.tile([0.4, 0.0, 2.0], (44, 1)), abs=1e-3)  # they agree
    assert np.abs(found.velocity).max() < 0.01


def test_a_believed_frame_that_the_next_contradicts_is_dropped_with_the_speed_that_it_set() -> None:
    times = STEP * np.arange(80)
    position = np.tile([0.0, 0.0, 2.0], (80, 1))
    position[60, 0] = 0.08
    found = estimate(np.zeros(3), position, times, **LOOSE, tolerance=0.1, reach=(0.08, 0.1, 0.3))
    assert found.refused[-1] == 0 and found.velocity[60, 0] > 0.5
    assert np.abs(found.velocity[61:]).max() < 1e-3 and np.abs(found.disturbance[61:, 0]).max() < 1e-3


@pytest.mark.parametrize(("off", "refused"), [(0.24, 0), (0.25, 1)])
def test_the_reach_grows_with_the_time_since_the_last_believed_frame(off: float, refused: int) -> None:
    times = STEP * np.arange(60)
    position = np.tile([0.0, 0.0, 2.0], (60, 1))
    position[50, 1] = off
    stamp = np.where((times > 2.0) & (times < 2.5), 2.0, times)
    loose = {**LOOSE, "acceleration_noise": (5.0,) * 3}
    found = estimate(np.zeros(3), position, stamp, **loose, reach=(0.1, 0.04, 1.0))  # 24.5 cm after 0.5 s
    assert found.refused[50] == refused


def test_before_the_first_frame_any_place_is_in_reach() -> None:
    found = estimate(
        np.zeros(3), np.tile([2.0, 0.0, 0.0], (5, 1)), STEP * np.arange(5), reach=(0.01, 0.0, 0.0)
    )
    assert found.refused[-1] == 0 and found.estimate[-1, 0] == pytest.approx(2.0, abs=0.1)


def test_after_a_second_of_refusals_it_begins_anew_where_the_frames_are() -> None:
    times = STEP * np.arange(120)
    position = np.where(times[:, None] < 3.0, 0.0, [5.0, -5.0, 1.0])
    result = estimate(np.zeros(3), position, times)
    assert np.abs(result.estimate[:80]).max() < 1e-9
    assert result.refused[79] == 20  # at 20 Hz from 3 s on; the one of 4 s is believed
    assert result.estimate[80:] == pytest.approx(np.tile([5.0, -5.0, 1.0], (40, 1)), abs=1e-6)
    assert result.refused[-1] == 20


def test_frames_contradict_from_a_refused_one_to_the_next_that_is_believed() -> None:
    times = STEP * np.arange(120)
    position = np.where((times >= 2.0)[:, None] & (times < 2.5)[:, None], [5.0, 0.0, 0.0], 0.0)
    result = estimate(np.zeros(3), position, times)
    assert np.array_equal(result.contradicted, (times >= 2.0) & (times < 2.5))


@pytest.mark.parametrize("late", [0.2, 0.3, 0.4, 0.6])
def test_positions_of_earlier_instants_than_their_stamps_strain_the_filter_until_it_refuses(
    late: float,
) -> None:
    times = STEP * np.arange(160)
    speed, height = 1.5, np.array([0.0, 0.0, 1.0])

    def place(time: Any) -> Any:
        return 0.5 * np.column_stack((np.cos(speed * time), np.sin(speed * time), 0.0 * time)) + height

    known = -(speed**2) * (place(times) - height)
    position = place(np.where(times < 4.0, times, times - late)) + np.random.default_rng(1).normal(
        0, 2e-3, (160, 3)
    )
    model: dict[str, Any] = {"noise": (2e-3,) * 3, "initial": (0.5, 0.0, 1.0)}
    found = estimate(known, position, times, tolerance=0.5, **model)
    first = np.argmax(found.contradicted[80:])
    assert found.contradicted[80:].any() and 0 < first <= 10
    assert not found.contradicted[20:80].any()  # as long as stamps are right
    for more in ({"strain_limit": 1e9}, {"contact": 1.2}):
        lenient = estimate(known, position, times, tolerance=0.5, **model, **more)
        assert not lenient.contradicted[80:].any()


def test_refused_frames_that_agree_with_each_other_are_believed_as_they_move() -> None:
    times = STEP * np.arange(200)
    place = np.array([0.0, 0.0, 2.0]) + np.outer(0.4 * times, [1.0, 0.0, 0.0])
    place[:, 0] += np.where(times >= 5.0, 3.0, 0.0)
    rng = np.random.default_rng(1)
    model: dict[str, Any] = {"noise": (5e-3,) * 3, "initial": (0.0, 0.0, 2.0)}
    found = estimate(np.zeros(3), place + rng.normal(0, 5e-3, (200, 3)), times, **model)
    refused = (times >= 5.0 - 1e-9) & (times < 6.0 - 1e-9)
    assert np.array_equal(found.contradicted, refused)
    after = times >= 6.0 - 1e-9
    assert np.abs(found.estimate[after] - place[after]).max() < 0.02
    assert np.abs(found.velocity[after] - [0.4, 0.0, 0.0]).max() < 0.06


def test_refused_frames_that_contradict_the_accelerations_are_never_believed() -> None:
    times = STEP * np.arange(200)
    rng = np.random.default_rng(1)
    place = np.array([0.0, 0.0, 2.0]) + rng.normal(0, 5e-3, (200, 3))
    wrong = times >= 5.0
    sway = 2.0 + np.sin(4.0 * (times - 5.0))  # no acceleration is known that would move it so
    place[:, 0] += np.where(wrong, sway, 0.0)
    calm: dict[str, Any] = {"acceleration_noise": (0.01,) * 3, "wander": (0.02,) * 3, "noise": (5e-3,) * 3}
    found = estimate(np.zeros(3), place, times, initial=(0.0, 0.0, 2.0), **calm)
    assert found.contradicted[wrong].all()
    assert np.abs(found.estimate[wrong] - [0.0, 0.0, 2.0]).max() < 0.1


def fall(contact: float) -> Driven:
    """Stand on the ground for 3 s with rotors that idle: the known acceleration says that it falls."""
    times = STEP * np.arange(60)
    place = np.random.default_rng(1).normal(0, 2e-3, (60, 3))
    return estimate(np.array([0.3, 0.0, -9.8]), place, times, contact=contact, tolerance=0.1)


def test_on_the_ground_frames_set_the_height_anew_and_teach_no_wind() -> None:
    found = fall(contact=0.2)
    assert not found.contradicted.any() and np.abs(found.estimate[:, 2]).max() < 0.5
    assert np.abs(found.disturbance[:, :2]).max() == 0.0
    assert fall(contact=-100.0).contradicted.any()


def test_high_up_a_frame_of_the_ground_is_refused() -> None:
    times = STEP * np.arange(100)
    place = np.where((times >= 2.0)[:, None], np.zeros(3), np.array([0.0, 0.0, 2.0]))
    found = estimate(np.zeros(3), place, times, initial=(0.0, 0.0, 2.0), contact=0.2, tolerance=0.1)
    assert found.contradicted[40:58].all() and found.estimate[40:58, 2] == pytest.approx(2.0, abs=0.05)


def test_a_frame_from_before_its_memory_or_from_the_future_is_refused() -> None:
    position = np.zeros((100, 3))
    stamp = STEP * np.arange(100)
    stamp[80] = STEP * 10
    stamp[90] = STEP * 91
    result = estimate(np.zeros(3), position, stamp)
    assert result.refused[79:82].tolist() == [0, 1, 1] and result.refused[-1] == 2


def test_the_same_frame_twice_counts_once_and_a_poor_one_not_at_all() -> None:
    times = STEP * np.arange(40)
    first = np.where(times < 1.0, times, 1.0)
    held = estimate(np.zeros(3), np.zeros((40, 3)), first)
    gone = estimate(np.zeros(3), np.where(times[:, None] <= 1.0, np.zeros(3), np.nan), first)
    assert np.array_equal(held.covariance, gone.covariance)
    assert np.isnan(held.nis[21:]).all()


def test_what_the_pose_says_of_its_variance_adds_to_the_noise() -> None:
    states, known = flight(5, 60)
    position, stamp = frames(states, latency=0, every=1, seed=5)
    share = NOISE / math.sqrt(2)
    block = PositionFilter(**{**MODEL, "noise": (share,) * 3})
    measured = share**2 * np.eye(4)
    both = drive(block, acceleration=known, position=position, stamp=stamp, measured=measured, rate=RATE)
    assert both.estimate == pytest.approx(estimate(known, position, stamp).estimate, abs=1e-12)


def test_it_begins_with_a_disturbance_as_unknown_as_it_is_told() -> None:
    count, known, parameters = 13, np.zeros((13, 3)), {"initial_disturbance": (5.0, 0.0, 0.0)}
    time = STEP * np.arange(count)
    position = np.repeat(0.5 * 4.0 * time[:, None] ** 2, 3, axis=1)
    result = estimate(known, position, time, **parameters)
    assert result.covariance[0, :, 2, 2] == pytest.approx([25.0, WANDER**2, WANDER**2])
    assert result.disturbance[-1, 0] == pytest.approx(4.0, rel=0.1)
    assert (np.abs(result.disturbance[-1, 1:]) < 2.0).all()


def test_it_begins_at_its_initial_position_and_is_not_ok_before_a_frame() -> None:
    result = drive(
        PositionFilter(initial=(1.0, 2.0, 3.0)), acceleration=np.zeros(3), position=np.full(3, np.nan),
        stamp=np.nan, rate=RATE, steps=5,
    )  # fmt: skip
    assert (result.estimate == [1.0, 2.0, 3.0]).all() and not result.ok.any()


@native(takes=("float64[3,9]", "float64[3]", "float64[3]", "float64", "float64[10]"), gives=("float64[3,9]",))
def predicted(chains: Any, before: Any, after: Any, step: float, model: Any) -> Any:
    found = chains.copy()
    predict(found, before, after, step, model)
    return found


@pytest.mark.slow
def test_machine_code_predicts_to_the_bit_what_the_interpreter_predicts() -> None:
    prepare([predicted])
    assert predicted.is_native
    rng = np.random.default_rng(4)
    for _ in range(500):
        chains, model = rng.uniform(0.0, 0.01, (3, 9)), rng.uniform(0.1, 12.0, 10)
        before, after = rng.normal(size=(2, 3))
        given = chains, before, after, rng.uniform(0.001, 0.1), model
        assert np.array_equal(predicted(*given), predicted.function(*given))
