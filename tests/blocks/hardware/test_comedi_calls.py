"""The calls of Debian's python3-comedilib over a library of C that stands in for libcomedi.

The module is the real one, so names, arguments and what comes back are; and the stand-in of Python agrees
with it. Tried only where that package and a compiler of C are installed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.errors import quoted
from tests.blocks.hardware.cards import STAND_INS

DEBIAN = Path("/usr/lib/python3/dist-packages")
ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(
    not list(DEBIAN.glob(f"comedi/_comedi.cpython-{sys.version_info[0]}{sys.version_info[1]}-*"))
    or shutil.which("cc") is None,
    reason="python3-comedilib is not installed for this Python, or no compiler",
)

CALLS = """
import sys
sys.path.append(sys.argv[1])
from comedi import comedi as c
device = c.comedi_open(sys.argv[2])
found = c.comedi_get_range(device, 0, 0, 2)
print(c.comedi_open("/dev/none"), c.comedi_strerror(5).lower(), c.UNIT_volt, c.UNIT_mA)
print(found.min, found.max, found.unit, c.comedi_get_range(device, 0, 0, 9))
print([c.comedi_from_phys(v, found, 4095) for v in (-5.0, -4.999, -1.2345, 0.0, 1.2345, 4.999, 5.0)])
print(c.comedi_to_phys(0, found, 4095))
c.comedi_set_global_oor_behavior(c.COMEDI_OOR_NUMBER)
print([c.comedi_to_phys(n, found, 4095) for n in (0, 1, 2048, 4095)])
print(type(c.comedi_data_read(device, 1, 1, 0, c.AREF_GROUND)), len(c.comedi_data_read(device, 1, 1, 0, 0)))
print(c.comedi_dio_read(device, 2, 1), c.comedi_data_write(device, 0, 1, 2, c.AREF_GROUND, 77))
print(c.comedi_dio_config(device, 2, 1, c.COMEDI_INPUT), c.AREF_DIFF, c.COMEDI_SUBD_AO, c.COMEDI_SUBD_COUNTER)
print(c.comedi_find_subdevice_by_type(device, c.COMEDI_SUBD_DIO, 0), c.comedi_close(device))
try:
    c.comedi_data_write(device, 0, 1, 2, 0, 77.0)
except TypeError:
    print("whole numbers only")
"""
USE = """
import sys
sys.path.append(sys.argv[1])
from quadvis_blocks.hardware._cards.ports import ChannelError, open_card
from quadvis_blocks.hardware.adc_in import AdcIn
from quadvis_blocks.hardware.dac_out import DacOut
ends = {"lowest": [-5.0, 0.0], "highest": [5.0, 5.0], "initial": [0.0, 5.0], "safe": [-5.0, 0.0]}
made = DacOut(port="comedi:" + sys.argv[2], channels=[2, 6], ranges=[2, 0], **ends)
port = made.settings.open(made.port_given)
try:
    port.write(made.initial_frame())
except ChannelError as error:
    print(error)
port.close()
made = AdcIn(port="comedi:" + sys.argv[2], channels=[2, 4], ranges=[-5.0, 10.0])
print([round(each, 6) for each in open_card(made.settings.card, sends=False).read()])
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the library that stands in for libcomedi."""
    made = tmp_path_factory.mktemp("comedi") / "libcomedi.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", made, STAND_INS / "comedi.c"], check=True)
    return made


def run(code: str, module: Path, folder: Path, library: Path | None = None) -> list[str]:
    (folder / "device").touch()
    environment = {**os.environ, "CARD_LOG": str(folder / "card.log"), "PYTHONPATH": str(STAND_INS)}
    if library is not None:
        environment |= {"LD_PRELOAD": str(library), "PYTHONPATH": ""}
    found = subprocess.run(
        [sys.executable, "-c", code, module, folder / "device"],
        capture_output=True, text=True, env=environment, cwd=ROOT, check=True,
    )  # fmt: skip
    return found.stdout.splitlines()


def test_the_stand_in_returns_what_the_module_of_debian_returns(library: Path, tmp_path: Path) -> None:
    assert run(CALLS, STAND_INS, tmp_path) == run(CALLS, DEBIAN, tmp_path, library)


def test_channels_are_written_and_read_by_the_module_of_debian(library: Path, tmp_path: Path) -> None:
    port = f"comedi:{tmp_path}/device"
    found = run(USE, DEBIAN, tmp_path, library)
    assert found == [
        f"channel 6 of {quoted(port)} cannot be written: input/output error",
        str([round(-5 + (1000 + 200) / 4095 * 10, 6), round((3000 + 100) / 4095 * 10, 6)]),
    ]
    assert (tmp_path / "card.log").read_text() == "0 analog 1 2048\n"
