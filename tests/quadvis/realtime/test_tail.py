"""Rows that no supervisor has taken: a ring keeps them, and an application adds them to the log."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from quadvis import read_log, replay
from quadvis.realtime.ring import RecordRing
from quadvis.realtime.words import whole_words
from tests.processes import children, gone, linux, wait_for

LOST = 10  # rows at most, of 1000 a second
TEXT = """\
quadvis: 1
name: counted
rates: {quick: 1 kHz, slow: 20 Hz}
stop_time: 100 s
on_host_loss: %s
overload: {action: warn}
blocks:
  count: {block: own.count, rate: quick}
  delayed: {block: signal.delay, rate: quick, in: {u: count.y}}
  sampled: {block: signal.gain, rate: slow, in: {u: {from: count.y, across: sample}}}
log: {every: {quick: 3}}
"""
COUNT = '''
from pathlib import Path

from quadvis.block import Block, Out


class Count(Block, numeric=False):
    """Counts its steps, in a file too."""

    y = Out()
    harmless = True

    def open(self):
        self.count, self.file = 0, open("steps", "w")

    def read(self):
        self.count += 1
        self.file.seek(0)
        self.file.write(str(self.count))
        self.file.flush()

    def output(self):
        return float(self.count)
'''


def test_a_ring_keeps_the_newest_records_for_who_has_put_them() -> None:
    ring = RecordRing(whole_words(RecordRing.size(4, 2)), 4, 2)
    raw = memoryview(np.arange(10)).cast("B")
    assert ring.kept().tolist() == []
    for number in range(3):
        ring.put(number, raw, [slice(8 * number, 8 * number + 8)])
    ring.take()
    ring.put(3, raw, [slice(24, 32)])
    assert ring.kept().tolist() == [[0, 0], [1, 1], [2, 2], [3, 3]]
    ring.put(4, raw, [slice(32, 40)])
    assert ring.kept().tolist() == [[1, 1], [2, 2], [3, 3], [4, 4]]


@linux
@pytest.mark.slow
@pytest.mark.parametrize("policy", ["stop", "continue"])
def test_the_log_of_a_run_whose_command_is_killed_lacks_few_rows_and_is_replayed(
    policy: str, tmp_path: Path
) -> None:
    (tmp_path / "counted.yaml").write_text(TEXT % policy)
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "count.py").write_text(COUNT)
    command = [sys.executable, "-m", "quadvis", "run", "counted.yaml", "--real-time", "--log", "run.mcap"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        steps = tmp_path / "steps"
        wait_for(lambda: steps.exists() and int(steps.read_text() or 0) > 1500)
        mine = children(run)
        made = int(steps.read_text())
        run.kill()
        if policy == "continue":
            wait_for(lambda: int(steps.read_text() or 0) > made + 500)
            made += 500
            for process in mine:
                if not gone(process):
                    os.kill(process, signal.SIGTERM)
        wait_for(lambda: all(map(gone, mine)))
    log = read_log(tmp_path / "run.mcap")
    assert log.hidden["_replay/inputs/count.y"][-1] >= made - LOST
    assert log["count.y"][-1] >= made - LOST - 3
    found = replay(log)
    assert found.same and found.ticks >= made - LOST and not found.whole
