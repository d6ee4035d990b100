"""Override, failsafe and switch one after the other, as parts of the diagrams wire them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.supervision.failsafe import Failsafe
from quadvis_blocks.supervision.mode_switch import ModeSwitch
from quadvis_blocks.supervision.stick_override import StickOverride

PILOT, LAW, NOBODY = range(3)

ticks = st.lists(
    st.tuples(
        st.lists(st.floats(-1, 1), min_size=4, max_size=4),  # sticks
        st.lists(st.sampled_from([-1.0, 1.0, 1.0]), min_size=4, max_size=4),  # switches
        st.integers(0, 3),  # vision
        st.sampled_from([False, False, True]),  # IMU stale
        st.sampled_from([False, False, True]),  # sticks stale
        st.lists(st.floats(-20, 20), min_size=4, max_size=4),  # what the law wants
    ),
    min_size=2,
    max_size=30,
)


@given(ticks, st.sampled_from(["land", "manual"]), st.sampled_from(["neutral", "pilot"]))
def test_whatever_pilot_and_failures_do_no_control_jumps_and_none_has_two_masters(
    ticks: list, on_loss: str, imu_lost: str
) -> None:
    sticks, switches, vision, imu_stale, sticks_stale, law = (
        np.array(column) for column in zip(*ticks, strict=True)
    )
    pilot = drive(StickOverride(), sticks=sticks, switches=switches, stale=sticks_stale, rate="20 Hz")
    modes = drive(
        Failsafe(on_loss=on_loss, imu_lost=imu_lost), automatic=pilot.automatic, overridden=pilot.overridden,
        vision=vision, vision_stale=vision > 0, imu_stale=imu_stale, sticks_stale=sticks_stale, rate="20 Hz",
    )  # fmt: skip
    flown = drive(
        ModeSwitch(), manual=5.0 * sticks, collective=law[:, 0], roll=law[:, 1], pitch=law[:, 2],
        yaw=law[:, 3], automatic=modes.allowed, neutral=modes.neutral, rate="20 Hz",
    )  # fmt: skip
    changed = flown.source[1:] != flown.source[:-1]
    assert (np.diff(flown.controls, axis=0)[changed] == 0.0).all()
    assert ((flown.source == LAW) == modes.allowed).all()
    assert not ((flown.source == LAW) & pilot.overridden).any()
    assert not (flown.source == LAW)[imu_stale, 1:3].any()
    assert (flown.source == NOBODY)[imu_stale & sticks_stale, 1:3].all()
    assert ((flown.source == PILOT) == ~modes.allowed & ~modes.neutral).all()
