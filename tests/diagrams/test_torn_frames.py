"""The hover whose pictures are torn again and again: a pose from two instants is none, whatever it shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import quadvis
from tests.diagrams.golden import DIAGRAMS

CEILING = 4.5  # m
WRONG = 0.05  # m, the largest error of a pose that counts
FIRST, LENGTH, EVERY, SPELLS = 2.5, 0.8, 2.5, 12  # s, and how often
FAILING = """
  eyes:
    part: failing_eyes.yaml
    at: world
    rate: camera
    with: {ceiling: $ceiling, side: $side}
    in: {position: {from: craft.position, across: sample}, attitude: {from: craft.attitude, across: sample}}
"""


def failing(kind: str) -> str:
    """Return the part: a camera, and behind it a block for each spell of torn pictures."""
    lines = [
        "quadvis: 1",
        "name: failing eyes",
        "params: {ceiling: 4.5 m, side: 1 m}",
        f"ports: {{in: [position, attitude], out: {{frame: fault{SPELLS - 1}.faulty}}}}",
        "blocks:",
        "  camera:",
        "    block: vision.rendered_camera",
        f"    with: {{calibration: {DIAGRAMS}/calib/camera.yaml, ceiling: $ceiling, side: $side,",
        "           latency: 100 ms}",
        "    in: {position: in.position, attitude: in.attitude}",
    ]
    for spell in range(SPELLS):
        lines += [
            f"  fault{spell}:",
            "    block: vision.frame_fault",
            f"    with: {{kind: {kind}, begin: {FIRST + EVERY * spell} s, duration: {LENGTH} s}}",
            f"    in: {{frame: {f'fault{spell - 1}.faulty' if spell else 'camera.frame'}}}",
        ]
    return "\n".join(lines) + "\n"


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed"), [("tear", 1), ("tear", 3), ("tear", 4), ("half_before", 0)])
def test_no_pose_of_a_torn_picture_counts_that_is_wrong(kind: str, seed: int, tmp_path: Path) -> None:
    """Before there was a gate for them, seed 3 lost the craft, and 1 and 4 had 6 and 5 such poses."""
    (tmp_path / "failing_eyes.yaml").write_text(failing(kind))
    path = tmp_path / "desk.yaml"
    flight = f"base: {{file: {DIAGRAMS}/flight.yaml, variant: sim}}\nblocks:{FAILING}"
    path.write_text(f"quadvis: 1\nname: desk\n{flight}")
    seen = quadvis.load(path, stop_time=FIRST + EVERY * SPELLS, seed=seed).run()

    at, times = seen["supervision/news.instant"], seen.times("craft/body.position")
    body, pose = seen["craft/body.position"], seen["pose.position"]
    true = np.stack([np.interp(at, times, body[:, axis]) for axis in range(3)], axis=1)
    error = np.abs(np.stack([pose[:, 0], pose[:, 1], CEILING - pose[:, 2]], axis=1) - true).max(axis=1)
    judged = np.searchsorted(seen.times("estimate/position.contradicted"), seen.times("pose.position"))
    refused = seen["estimate/position.contradicted"]
    refused = refused[np.minimum(judged, len(refused) - 1)]
    counts = seen["supervision/news.fresh"] & seen["supervision/check.plausible"] & ~refused
    assert not (counts & (error > WRONG)).any(), error[counts & (error > WRONG)]
    assert np.abs(body - [0.0, 0.0, 1.5]).max() < 1.0
    # The frames between the spells count again: nothing is locked out.
    whole = ((at - FIRST) % EVERY > LENGTH + 0.5) & (at > FIRST)
    assert counts[whole & (np.diff(at, prepend=-1.0) > 0)].mean() > 0.9
