"""What is said during a run: nobody has to read it."""

from __future__ import annotations

import io
import os

import pytest

from quadvis.machine.status_line import StatusLine

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes of a Unix")


def test_what_is_said_goes_into_a_pipe_and_a_file_without_a_descriptor() -> None:
    reader, writer = os.pipe()
    with os.fdopen(writer, "w") as stream, StatusLine(stream) as line:
        line.say("one")
        assert os.read(reader, 100) == b"one\n"
    os.close(reader)
    text = io.StringIO()
    StatusLine(text).say("two")
    assert text.getvalue() == "two\n"


def test_a_pipe_that_nobody_reads_holds_up_nobody_and_is_used_again_once_somebody_does() -> None:
    reader, writer = os.pipe()
    with os.fdopen(writer, "w") as stream, StatusLine(stream) as line:
        for number in range(10_000):
            line.say(f"{number}: {'x' * 100}")
        found = os.read(reader, 1 << 20)
        assert found.startswith(b"0: x") and found.count(b"\n") < 10_000
        line.say("again")
        assert os.read(reader, 100) == b"again\n"
    os.close(reader)
