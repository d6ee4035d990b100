"""The skeleton of an output device and of its test, for `quadvis new device GROUP.NAME`."""

from __future__ import annotations

DEVICE = '''"""{title}."""

from __future__ import annotations

from typing import Any

from quadvis.block import In, Initial, Line, Output, Param, Safe


class {name}(Output):
    """Commands as lines of text: what the device does, in one sentence.

    Say here where its protocol comes from, and what it does when no frames come.
    """

    line = Line(115_200)
    rate = "50 Hz"

    port = Param(type="port", doc="serial port, udp:HOST:PORT, or a cable: pty:name")
    initial = Initial("command", doc="before the first command")
    safe = Safe("command", doc="at every end")
    command = In("float64[n]", doc="the commands, each from -1 to 1")

    def frame(self, command: Any) -> bytes:
        """Return a line of whole thousandths, with commas between them."""
        return b",".join(b"%d" % round(1000.0 * each) for each in command) + b"\\n"
'''

DEVICE_GIVEN = """GIVEN: dict[str, Any] = {"port": "pty:name", "initial": [0, 0], "safe": [0, -1]}
"""

DEVICE_TEST = '''"""Tests of the block {path}."""

{head}

def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes() -> None:
    device = {name}(**GIVEN)
    found = drive_output(device, command=[[0.5, 1.0], [-0.25, 0.0]])
    assert found.initial == b"0,0\\n"
    assert found.commands == [b"500,1000\\n", b"-250,0\\n"]
    assert found.safe == b"0,-1000\\n"


def test_values_that_give_no_frame_are_refused() -> None:
    with pytest.raises(ParameterError, match="safe gives no frame"):
        {name}(**GIVEN | {{"safe": [float("inf"), 0.0]}})
'''
