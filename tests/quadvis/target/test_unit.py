"""The systemd unit of a target."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.cli.options import parser
from quadvis.errors import QuadvisError
from quadvis.target.unit import unit_text


def entries(text: str) -> dict[str, dict[str, str]]:
    """Return the entries of a unit by section."""
    found: dict[str, dict[str, str]] = {}
    for line in filter(None, text.splitlines()):
        if line.startswith("["):
            section = found.setdefault(line.strip("[]"), {})
        else:
            name, _, value = line.partition("=")
            section[name] = value
    return found


def test_a_unit_starts_at_boot_is_watched_and_may_use_real_time() -> None:
    made = entries(unit_text("lab1", listen="0.0.0.0", startup="hover", cpu="1, 2"))
    service = made["Service"]
    expected = {
        "LimitRTPRIO": "99", "LimitMEMLOCK": "infinity", "CPUAffinity": "1 2",
        "Restart": "on-failure", "StateDirectory": "quadvis/lab1",
        "RuntimeDirectory": "quadvis/lab1", "Type": "notify", "KillMode": "control-group",
        "OOMPolicy": "continue",
        "SuccessExitStatus": "143",
    }  # fmt: skip
    assert expected.items() <= service.items()
    assert int(service["WatchdogSec"]) > 0 and made["Install"]["WantedBy"] == "multi-user.target"
    assert made["Unit"]["After"] == "network-online.target"
    python, *words = shlex.split(service["ExecStart"])
    assert python == sys.executable and words[:2] == ["-m", "quadvis"]
    options = parser().parse_args(words[2:])
    assert (options.name, options.listen, options.startup) == ("lab1", "0.0.0.0", "hover")
    plain = entries(unit_text("lab1"))
    assert "CPUAffinity" not in plain["Service"] and "After" not in plain["Unit"]


def test_a_unit_has_the_folder_and_a_name_that_the_target_takes() -> None:
    service = entries(unit_text("lab1", folder="/srv/50% of $HOME/ü"))["Service"]
    assert "%% of $$HOME" in service["ExecStart"]
    words = shlex.split(service["ExecStart"].replace("%%", "%").replace("$$", "$"))
    assert parser().parse_args(words[3:]).folder == "/srv/50% of $HOME/ü"
    for name in ("a b", "ä", "a/b", ""):
        with pytest.raises(QuadvisError, match="cannot be a name"):
            unit_text(name)


def test_an_option_that_a_unit_does_not_have_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["target", "install", "--until-idle", "3", "-o", "-"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.partition(" is for")[0]) == ("", "--until-idle")


def test_wrong_processors_are_refused() -> None:
    with pytest.raises(QuadvisError, match="numbers of processors"):
        unit_text("lab1", cpu="one")


def test_the_command_writes_it_and_says_what_comes_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "quadvis-lab1.service"
    words = ["target", "install", "--name", "lab1", "--startup", "hover"]
    assert main([*words, "-o", str(path)]) == 0
    assert main([*words, "-o", "-"]) == 0
    assert path.read_text() in capsys.readouterr().out
    path.write_text("something else")
    assert main([*words, "-o", str(path)]) == 2  # no output replaces a file of another kind


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd-analyze here")
def test_systemd_finds_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "quadvis-lab1.service"
    path.write_text(unit_text("lab1", listen="0.0.0.0", startup="hover", cpu="0"))
    done = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True)
    assert "quadvis-lab1.service" not in done.stderr, done.stderr
