"""The files of `quadvis new project`: a loop with a calibration and a block of its own, tests, and CI."""

from __future__ import annotations

README = """# {name}

A tank whose level a PI controller holds, measured by a gauge. Change it into your own.

| | |
|---|---|
| [{name}.yaml]({name}.yaml) | the diagram: the tank, its gauge, the controller; what is expected of it |
| [calib/gauge.yaml](calib/gauge.yaml) | the calibration of the gauge |
| [blocks/sensors/gauge.py](blocks/sensors/gauge.py) | a block of this project, found beside the diagram |
| [tests](tests) | what the block must do, and what the loop must |
| [.github/workflows/check.yml](.github/workflows/check.yml) | the same on every push |

```sh
pip install -r requirements.txt
quadvis check {name}.yaml      # units, shapes, rates, loops
quadvis run {name}.yaml        # exit code 0: all that is expected of it is met
quadvis plot runs/{name}.mcap
quadvis draw {name}.yaml
quadvis new block sensors.other
python -m pytest
```

In git, changes and merges go by block and key with three lines, see `quadvis merge --help`.
"""

DIAGRAM = """# A tank whose level a PI controller holds; at 100 s someone opens a second outlet.
quadvis: 1
name: {name}
doc: The level of a tank, measured by a gauge and held by a PI controller.

params:
  calibration: {{group: calib/gauge.yaml}}  # of the gauge
  area: 0.05 m^2
  outlet: 0.002 m^2/s  # flow per level
  second: 0.001 m^2/s  # of the outlet that someone opens
  wanted: 30 cm

rates: {{control: 10 Hz}}
solver: {{method: ode4, step: 20 ms}}
stop_time: 200 s
seed: 1

blocks:
  target: {{block: sources.step, rate: control, with: {{after: $wanted, at: 5 s}}}}
  controller:
    block: systems.pid
    rate: control
    with: {{kp: 0.01 m^2/s, ki: 0.001 m^2/s^2, lower: 0 l/s, upper: 2 l/s}}
    in: {{reference: target.y, measurement: gauge.level}}
  opened: {{block: sources.step, rate: control, with: {{after: $second, at: 100 s}}}}
  flow:
    block: math.expression
    rate: continuous
    with: {{y: (pump - (outlet + more) * level) / area, area: $area, outlet: $outlet}}
    in:
      pump: {{from: controller.y, across: hold}}
      more: {{from: opened.y, across: hold}}
      level: tank.y
  tank: {{block: signal.integrator, with: {{lower: 0 m, upper: 1 m}}, in: {{u: flow.y}}}}
  wire:
    block: math.expression
    rate: control
    with: {{y: zero + level / slope, zero: $calibration.zero, slope: $calibration.slope}}
    in: {{level: {{from: tank.y, across: sample}}}}
  gauge: {{block: sensors.gauge, group: $calibration, rate: control, in: {{voltage: wire.y}}}}

expect:
  - {{signal: tank.y, of: $wanted, after: 80 s, before: 100 s, within: 1 cm}}
  - {{signal: tank.y, of: $wanted, after: 180 s, within: 1 cm}}
  - {{signal: tank.y, below: 40 cm}}

summary:
  level: {{signal: tank.y, of: $wanted, after: 50 s, show: [rms, max], unit: cm}}

figures:
  - title: Level
    panels:
      - {{title: level, signals: [tank.y, gauge.level], unit: cm}}
      - {{title: pump, signals: [controller.y], unit: l/s}}
"""

CALIBRATION = """# The gauge in the tank: from readings at two levels.
quadvis: 1
name: gauge

params:
  zero: 0.5 V      # of an empty tank
  slope: 0.25 m/V
"""

BLOCK = '''"""A level gauge."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param


class Gauge(Block):
    """The level that a gauge shows by its voltage.

    ``level = slope * (voltage - zero)``: a line through the readings of the calibration.
    """

    zero = Param(0.0, unit="V", tune=True, doc="voltage of an empty tank")
    slope = Param(1.0, unit="m/V", above=0.0, tune=True, doc="level per voltage")
    voltage = In(unit="V", doc="what the gauge gives")
    level = Out(unit="m", doc="the level")

    def output(self, voltage: float) -> float:
        """Return the level."""
        return self.slope * (voltage - self.zero)
'''

BLOCK_TEST = '''"""Tests of the block sensors.gauge."""

from pathlib import Path

import pytest
from quadvis.block import ParameterError
from quadvis.library.catalogue import Catalogue
from quadvis.testing import check_block, drive

BLOCKS = Catalogue(Path(__file__).parents[3])
Gauge = BLOCKS.find("sensors.gauge")


def test_it_does_what_every_block_must_do() -> None:
    check_block(Gauge, test=Path(__file__))


def test_the_line_goes_through_the_readings() -> None:
    level = drive(Gauge(zero=0.5, slope=0.25), voltage=[0.5, 2.5], rate="10 Hz").level
    assert level.tolist() == [0.0, 0.5]


def test_a_gauge_that_shows_nothing_is_refused() -> None:
    with pytest.raises(ParameterError, match="slope must be more than 0|slope must be above 0"):
        Gauge(slope=0.0)
'''

LOOP_TEST = '''"""Tests of the loop in {name}.yaml."""

from pathlib import Path

import pytest
import quadvis

DIAGRAM = Path(__file__).parents[1] / "{name}.yaml"


def test_the_loop_does_what_is_expected_of_it() -> None:
    result = quadvis.load(DIAGRAM).run()
    assert result.passed
    assert result["tank.y"][-1] == pytest.approx(0.3, abs=0.01)
    assert result["gauge.level"] == pytest.approx(result["wire.y"] * 0.25 - 0.125)


def test_a_gauge_with_another_zero_misses_the_level() -> None:
    result = quadvis.load(DIAGRAM, settings={{"gauge.zero": "0.1 V"}}).run()
    assert not result.passed
'''

WORKFLOW = """name: check
on: [push, pull_request]
jobs:
  check:
    runs-on: ubuntu-latest
    strategy:
      matrix:
        python: ["3.11", "3.12", "3.13"]
    steps:
      - uses: actions/checkout@v4
      - uses: actions/setup-python@v5
        with:
          python-version: ${{{{ matrix.python }}}}
      - run: pip install -r requirements.txt
      - run: quadvis fmt --check {name}.yaml calib/gauge.yaml
      - run: quadvis check {name}.yaml
      - run: python -m pytest
"""

IGNORED = """runs/
__pycache__/
.pytest_cache/
.venv/
"""

ATTRIBUTES = """*.yaml diff=quadvis merge=quadvis
"""

REQUIREMENTS = """quadvis>={version}
pytest>=8
"""

FILES = {
    "README.md": README,
    "{name}.yaml": DIAGRAM,
    "calib/gauge.yaml": CALIBRATION,
    "blocks/sensors/gauge.py": BLOCK,
    "tests/blocks/sensors/test_gauge.py": BLOCK_TEST,
    "tests/test_{name}.py": LOOP_TEST,
    ".github/workflows/check.yml": WORKFLOW,
    ".gitattributes": ATTRIBUTES,
    ".gitignore": IGNORED,
    "requirements.txt": REQUIREMENTS,
}
"""Texts by path; ``{name}`` and ``{version}`` are filled in where a text, or its path, has them."""

PLAIN = (CALIBRATION, BLOCK, BLOCK_TEST, IGNORED, ATTRIBUTES)  # have nothing to fill in
