import math
from fractions import Fraction

import control
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete

import quadvis
from quadvis.analysis import linearise
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.probe import Positions, Probe
from quadvis.analysis.state import Columns, find_state
from quadvis.api import load_text
from quadvis.block import Block, In, Out, State
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Graph, Node, Task, Wire
from quadvis.units import parse_units
from quadvis_blocks.signal.gain import Gain
from quadvis_blocks.signal.unit_delay import UnitDelay
from tests.stages import mostly_slow

from .loops import DIAGRAMS, lifted, sampled, write


def nonzero(matrix):
    """Eigenvalues that are not those of a pure delay, in order."""
    values = np.linalg.eigvals(matrix)
    return np.sort_complex(values[np.abs(values) > 1e-6])


def test_the_papers_chains_have_the_polynomial_s_plus_1_to_the_fourth_each() -> None:
    linear = quadvis.load(DIAGRAMS / "margins.yaml").analyse().linear
    assert linear.period == 0.0
    assert np.poly(linear.a) == pytest.approx(np.poly(-np.ones(8)), rel=1e-6)


@pytest.mark.parametrize("bandwidth", [0.5, 2.0])
def test_the_bandwidth_moves_the_four_poles(bandwidth: float) -> None:
    diagram = quadvis.load(DIAGRAMS / "margins.yaml", settings={"bandwidth": f"{bandwidth} rad/s"})
    assert np.poly(diagram.analyse().linear.a) == pytest.approx(np.poly(-bandwidth * np.ones(8)), rel=1e-5)


def test_a_sampled_loop_has_the_matrix_of_the_exact_discretisation(tmp_path) -> None:
    plant = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    a, b, *_ = cont2discrete((*plant, np.eye(2), np.zeros((2, 1))), 0.05)
    expected = a - b @ np.array([[2.0, 1.5]])
    linear = sampled(tmp_path).analyse().linear
    assert linear.period == pytest.approx(0.05)
    assert sorted(linear.states) == ["place.integral", "speed.integral"]
    order = [linear.states.index(name) for name in ("place.integral", "speed.integral")]
    assert linear.a[np.ix_(order, order)] == pytest.approx(expected, abs=1e-9)


def test_lifted_over_two_periods_the_matrix_is_the_square(tmp_path) -> None:
    once, twice = sampled(tmp_path).analyse().linear, lifted(tmp_path).analyse().linear
    assert twice.period == pytest.approx(0.1)
    assert nonzero(twice.a) == pytest.approx(nonzero(once.a) ** 2, abs=1e-8)


def test_a_delay_inside_a_period_gives_its_known_polynomial(tmp_path) -> None:
    """x' = -k x(last sample, 22 ms ago): z^2 - (1 - k (T - d)) z + k d = 0."""
    gain, period, delay = 3.0, 0.1, 0.022
    diagram = quadvis.load(write(tmp_path, f"""
quadvis: 1
name: delayed
rates: {{slow: 10 Hz, link: 2 ms}}
solver: {{method: ode4, step: 2 ms}}
stop_time: 1 s
blocks:
  place:
    block: signal.integrator
    rate: continuous
    with: {{initial: 1 m}}
    in: {{u: {{from: "radio.y[0]", across: hold}}}}
  law:
    block: signal.gain
    rate: slow
    with: {{factor: {-gain} 1/s}}
    in: {{u: {{from: place.y, across: sample}}}}
  three: {{block: signal.concatenate, rate: slow, in: {{u: [law.y, 0, 0]}}}}
  radio:
    block: signal.transport_delay
    rate: link
    with: {{delay: 22 ms}}
    in: {{u: {{from: three.y, across: hold}}}}
"""))  # fmt: skip
    found = np.sort(nonzero(diagram.analyse().linear.a))
    expected = np.sort(np.roots([1.0, gain * (period - delay) - 1.0, gain * delay]))
    assert found == pytest.approx(expected, abs=1e-8)


def chain(bandwidth: float, delay: float) -> np.ndarray:
    """Eigenvalues of the lateral chain, control at 20 Hz, vision at 10 Hz, late by whole control periods.

    Written out by hand: state x (position, velocity, angle, rate), then the positions at past frames.
    """
    g, step = 9.81, 0.05
    a = np.zeros((4, 4))
    a[0, 1], a[1, 2], a[2, 3] = 1.0, g, 1.0
    both = expm(np.block([[a, np.array([[0.0], [0], [0], [1]])], [np.zeros((1, 5))]]) * step)
    phi, gamma = both[:4, :4], both[:4, 4:]
    gains = np.array([bandwidth**4 / g, 4 * bandwidth**3 / g, 6 * bandwidth**2, 4 * bandwidth])
    late = round(delay / step)
    frames = late // 2 + 3
    # One hyperperiod: a frame is taken, then two steps, each with what has arrived by then.
    size = 4 + frames

    def law(newest: int) -> np.ndarray:
        row = np.zeros(size)
        row[2:4] = gains[2:]
        row[4 + newest] += gains[0] + gains[1] / 0.1
        row[5 + newest] -= gains[1] / 0.1
        return -row

    taken = np.zeros((size, size))
    taken[:4, :4] = np.eye(4)
    taken[4, 0] = 1.0
    taken[5:, 4:-1] = np.eye(frames - 1)
    lifted = taken
    for half in range(2):
        newest = (late - half + 1) // 2  # frames since the one that has arrived: ceil((late - half) / 2)
        move = np.eye(size)
        move[:4, :4] = phi
        move[:4] += gamma @ law(newest)[None]
        lifted = move @ lifted
    return np.linalg.eigvals(lifted)


@pytest.mark.parametrize("delay", mostly_slow([0.05, 0.1, 0.25]))
def test_vision_and_control_at_their_rates_give_the_lifted_matrix_made_by_hand(delay: float) -> None:
    settings = {"latency": f"{delay} s", "bandwidth": "2 rad/s"}
    diagram = quadvis.load(DIAGRAMS / "sampled_margins.yaml", variant="ideal", settings=settings)
    found = np.linalg.eigvals(diagram.analyse().linear.a)
    expected = chain(2.0, delay)
    for value in expected[np.abs(expected) > 0.1]:
        assert np.abs(found - value).min() < 1e-6


@pytest.mark.slow
def test_noise_is_taken_away_and_the_seed_does_not_matter() -> None:
    quiet, noisy = (
        quadvis.load(
            DIAGRAMS / "hover.yaml", variant="geometric", settings={"eyes/camera.noise": noise}, seed=seed
        )
        .analyse()
        .linear.a
        for noise, seed in (("0 px", 1), ("1 px", 7))
    )
    assert quiet == pytest.approx(noisy, abs=1e-3)
    assert np.sort(np.abs(nonzero(quiet)))[-8:] == pytest.approx(
        np.sort(np.abs(nonzero(noisy)))[-8:], abs=1e-4
    )


def test_newtons_method_finds_the_steady_state_away_from_the_start(tmp_path) -> None:
    """Wind holds the craft at a lean, where the tangent is steeper than at the start."""
    diagram = quadvis.load(write(tmp_path, """
quadvis: 1
name: bent
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  craft:
    block: plant.lateral
    rate: continuous
    with: {tilt: tangent}
    in: {torque: law.torque, acceleration: 0.5 m/s^2}
  law:
    block: control.nested_saturation
    rate: continuous
    in:
      position: craft.position
      velocity: craft.velocity
      angle: craft.angle
      angular_rate: craft.angular_rate
"""))  # fmt: skip
    linear = diagram.analyse().linear
    row, column = linear.states.index("craft.speed"), linear.states.index("craft.lean")
    assert linear.a[row, column] == pytest.approx(9.81 * (1.0 + (0.5 / 9.81) ** 2), rel=1e-6)


def test_a_loop_that_begins_saturated_far_away_is_run_until_it_is_not() -> None:
    """At 20 rad/s the law flies 0.09 m/s at most, so the metre from the start takes 11 s."""
    diagram = quadvis.load(DIAGRAMS / "margins.yaml", settings={"bandwidth": "20 rad/s"})
    assert np.poly(diagram.analyse().linear.a / 20) == pytest.approx(np.poly(-np.ones(8)), rel=1e-5)


def test_the_state_space_of_the_closed_loop_is_one_of_python_control(tmp_path) -> None:
    system = sampled(tmp_path).analyse().system
    assert isinstance(system, control.StateSpace)
    assert system.dt == pytest.approx(0.05)
    assert sorted(system.state_labels) == ["place:integral", "speed:integral"]


def test_a_loop_without_a_steady_state_is_refused_with_what_goes_on_moving(tmp_path) -> None:
    diagram = quadvis.load(
        write(
            tmp_path,
            """
quadvis: 1
name: climbing
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  place: {block: signal.integrator, rate: continuous, with: {initial: 0 m}, in: {u: push.y}}
  still: {block: signal.gain, rate: continuous, with: {factor: 0 1/s}, in: {u: place.y}}
  push: {block: signal.sum, rate: continuous, in: {u: [still.y, 1 m/s]}}
""",
        )
    )
    with pytest.raises(AnalysisError, match=r"no steady state was found: 'place\.integral' goes on moving"):
        diagram.analyse()


def test_a_loop_with_an_edge_at_its_operating_point_is_refused(tmp_path) -> None:
    diagram = quadvis.load(
        write(
            tmp_path,
            """
quadvis: 1
name: edged
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  last: {block: signal.unit_delay, rate: fast, in: {u: held.y}}
  held: {block: signal.saturation, rate: fast, with: {lower: 0, upper: 1}, in: {u: less.y}}
  less: {block: signal.gain, rate: fast, with: {factor: 0.5}, in: {u: last.y}}
""",
        )
    )
    with pytest.raises(AnalysisError, match=r"an edge at its operating point, 'last\.last'"):
        diagram.analyse()


def test_rates_that_hardly_ever_meet_are_refused(tmp_path) -> None:
    diagram = quadvis.load(
        write(
            tmp_path,
            """
quadvis: 1
name: apart
rates: {one: 10007 us, other: 10 ms}
stop_time: 1 s
blocks:
  here: {block: signal.unit_delay, rate: one, in: {u: {from: there.y, across: newest}}}
  there: {block: signal.gain, rate: other, in: {u: {from: here.y, across: newest}}}
""",
        )
    )
    with pytest.raises(
        AnalysisError, match=r"repeat only after 100\.07 s.*choose rates that fit into each other"
    ):
        diagram.analyse()


CROSSED = """
quadvis: 1
name: crossed
rates: {fast: 20 Hz, slow: RATE}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  place:
    block: signal.integrator
    rate: continuous
    with: {initial: 1 m}
    in: {u: {from: law.y, across: ACROSS}}
  law:
    block: signal.gain
    rate: slow
    with: {factor: -3 1/s}
    in: {u: {from: place.y, across: sample}}
"""


def test_an_offset_of_a_rate_does_not_move_the_poles(tmp_path) -> None:
    """x[k+1] = (1 - 3 T) x[k], from wherever one begins to count."""
    for rate in ("10 Hz", "{rate: 10 Hz, offset: 50 ms}"):
        text = CROSSED.replace("RATE", rate).replace("ACROSS", "hold")
        linear = quadvis.load(write(tmp_path, text)).analyse(cuts={"law": "law.y"}).linear
        assert nonzero(linear.a) == pytest.approx([1 - 3 * 0.1], abs=1e-8)


def test_a_wire_with_a_delay_holds_a_state(tmp_path) -> None:
    """x[k+1] = x[k] - 3 T x[k-1]."""
    text = CROSSED.replace("RATE", "10 Hz").replace("ACROSS", "delay")
    found = nonzero(quadvis.load(write(tmp_path, text)).analyse().linear.a)
    assert found == pytest.approx(np.sort_complex(np.roots([1.0, -1.0, 0.3])), abs=1e-8)


def test_a_loop_that_grows_from_its_steady_state_is_linearised_too(tmp_path) -> None:
    """The run to the operating point goes away by 1.5 a period; Newton's method goes back."""
    text = CROSSED.replace("RATE", "10 Hz").replace("ACROSS", "hold").replace("-3 1/s", "-25 1/s")
    analysis = quadvis.load(write(tmp_path, text)).analyse()
    assert nonzero(analysis.linear.a) == pytest.approx([-1.5], abs=1e-8)
    assert not analysis.stable


def test_what_stands_beside_the_loop_is_no_part_of_it(tmp_path) -> None:
    """A filter of the loop's signal, a sum of it for the log, a prefilter and noise: none has a pole here."""
    text = (
        CROSSED.replace("RATE", "10 Hz").replace("ACROSS", "hold")
        + """
  smooth: {block: signal.low_pass, rate: fast, in: {u: {from: place.y, across: sample}}}
  total: {block: signal.integrator, rate: continuous, with: {initial: 0 m*s}, in: {u: place.y}}
  noise: {block: sources.noise, rate: fast}
  filtered: {block: signal.low_pass, rate: fast, in: {u: noise.y}}
"""
    )
    linear = quadvis.load(write(tmp_path, text)).analyse().linear
    assert linear.states == ("place.integral",)


def test_rates_beside_a_continuous_loop_leave_it_continuous(tmp_path) -> None:
    text = (DIAGRAMS / "margins.yaml").read_text().replace("solver:", "rates: {log: 7 Hz}\nsolver:")
    text = text.replace(
        "blocks:",
        "blocks:\n  seen: {block: signal.gain, rate: log, in: {u: {from: side.position, across: newest}}}",
    )
    linear = quadvis.load(write(tmp_path, text.replace("10 ms}", "1/700 s}"))).analyse().linear
    assert linear.period == 0.0 and len(linear.states) == 8


def test_a_chain_without_a_loop_is_linearised_as_it_is(tmp_path) -> None:
    """A lag of 0.2 s sampled at 10 Hz: the pole is exp(-T / 0.2)."""
    text = """
quadvis: 1
name: chain
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  source: {block: sources.constant, rate: fast, with: {value: 1}}
  lag: {block: signal.low_pass, rate: fast, with: {time_constant: 0.2 s}, in: {u: source.y}}
"""
    analysis = quadvis.load(write(tmp_path, text)).analyse()
    assert analysis.poles == pytest.approx([-5.0], rel=1e-6)
    with pytest.raises(AnalysisError, match="nothing to analyse: the diagram has no loop and no state"):
        quadvis.load(write(tmp_path, text.partition("  lag:")[0])).analyse()


class Instant(Block):
    """The instant of now."""

    y = Out(unit="s")

    def output(self, time: float) -> float:
        return time


def test_instants_are_no_signals_wherever_they_pass_but_a_loop_in_seconds_has_signals() -> None:
    task, seconds = Task("main", Fraction(1, 10)), {"y": parse_units("s")}
    nodes = [
        Node("clock", "", Instant(), task, {}, units=seconds),
        Node("later", "", UnitDelay(), task, {"u": Wire("clock", "y")}, {"*": ()}, seconds),
        Node("twice", "", Gain(factor=2.0), task, {"u": Wire("later", "y")}, {"*": ()}, seconds),
        Node("held", "", UnitDelay(), task, {"u": Wire("less", "y")}, {"*": ()}, seconds),
        Node("less", "", Gain(factor=0.5), task, {"u": Wire("held", "y")}, {"*": ()}, seconds),
    ]
    for some, signals in ((nodes, {"held", "less"}), (nodes[:3], set[str]())):
        probe = Probe(Engine(Graph("instants", some)), [], 0.0)
        assert {probe.names[int(place)].partition(".")[0] for place in probe.signals} == signals


class Record(Block):
    """What comes in, 30 periods of it, and a fading mean that nobody reads."""

    u, y = In(), Out()
    past = State("float64[300]")
    mean = State()

    def output(self, u: float) -> float:
        return u + self.past[295]

    def update(self, u: float) -> None:
        self.past[:-1] = self.past[1:].copy()
        self.past[-1] = u
        self.mean += 0.5 * (u - self.mean)


def test_what_no_block_reads_is_not_disturbed_slot_by_slot(monkeypatch: pytest.MonkeyPatch) -> None:
    """u[k] = 0.2 y[k-1], y[k] = u[k] + u[k-5]: z^5 (z - 0.2) = 0.2; the mean has its pole at 0.5."""
    disturbed: list[int] = []

    def counted(probe: Probe) -> tuple[Positions, Columns]:
        found = find_state(probe)
        disturbed.append(len(found[1]))
        return found

    monkeypatch.setattr(linearise, "find_state", counted)
    task = Task("main", Fraction(1, 10))
    nodes = [
        Node("later", "", UnitDelay(), task, {"u": Wire("record", "y")}, {"*": ()}),
        Node("less", "", Gain(factor=0.2), task, {"u": Wire("later", "y")}, {"*": ()}),
        Node("record", "", Record(), task, {"u": Wire("less", "y")}),
    ]
    linear = linearise.linearised(Graph("record", nodes), [], 0.0)
    expected = [*np.roots([1.0, -0.2, 0.0, 0.0, 0.0, 0.0, -0.2]), 0.5]
    assert nonzero(linear.a) == pytest.approx(np.sort_complex(expected), abs=1e-6)
    assert len(linear.states) == 7 and max(disturbed) < 50


GUARDED = [("blackout", None), ("landing", "robust"), ("takeover", "robust"), ("blackout", "robust")]


@pytest.mark.parametrize(("name", "variant"), mostly_slow(GUARDED, quick=0, slow=2))
def test_a_hover_under_the_failsafe_is_stable(name: str, variant: str | None) -> None:
    analysis = quadvis.load(DIAGRAMS / f"{name}.yaml", variant=variant).analyse()
    assert analysis.stable and not [state for state in analysis.linear.states if "stamp" in state]


def test_a_loop_at_a_limit_whose_law_stands_still_has_no_state_and_any_margin() -> None:
    analysis = load_text("""
quadvis: 1
name: stuck
rates: {control: 20 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  never: {block: logic.compare, rate: control, in: {a: 1, b: 0}}
  law: {block: signal.gain, rate: control, when: never.y, in: {u: {from: x.y, across: sample}}}
  fall:
    block: math.expression
    rate: continuous
    with: {y: k * (u - 1), k: 1 1/s}
    in: {u: {from: law.y, across: hold}}
  x: {block: signal.integrator, with: {lower: 0}, in: {u: fall.y}}
analyse:
  cuts: {law: law.y}
""").analyse()
    margins = analysis.loops["law"].margins
    assert analysis.linear.states == ()
    assert (margins.gain_up, margins.delay, analysis.stable) == (math.inf, math.inf, True)
