"""`quadvis completion`: bash itself completes with the script."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.cli.options import parser

COMPLETE = """\
source "$1"
shift
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_shtab_quadvis
printf '%s\\n' "${COMPREPLY[@]}"
"""
BASH = shutil.which("bash")


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "quadvis.bash"
    with pytest.MonkeyPatch.context() as patch, path.open("w") as file:
        patch.setattr("sys.stdout", file)
        assert main(["completion", "bash"]) == 0
    return path


def completed(script: Path, folder: Path, *words: str) -> list[str]:
    """Return what bash offers for the last word."""
    command = [BASH, "-c", COMPLETE, "bash", str(script), *words]
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return found.stdout.split()


@pytest.mark.skipif(BASH is None, reason="needs bash")
def test_bash_completes_commands_options_blocks_and_files(script: Path, tmp_path: Path) -> None:
    (tmp_path / "motor.yaml").touch()
    assert completed(script, tmp_path, "quadvis", "sw") == ["sweep"]
    assert completed(script, tmp_path, "quadvis", "run", "--stop") == ["--stop-time"]
    assert completed(script, tmp_path, "quadvis", "run", "mot") == ["motor.yaml"]
    assert completed(script, tmp_path, "quadvis", "describe", "signal.tran") == ["signal.transport_delay"]
    assert set(completed(script, tmp_path, "quadvis", "")) >= set(parser().commands)


@pytest.mark.parametrize("shell", ["zsh", "tcsh", "fish"])
def test_each_shell_has_a_script_with_all_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in parser().commands)


def test_another_shell_gets_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bsh"]) == 2
    assert "did you mean 'bash'?" in capsys.readouterr().err


def test_what_a_shell_needs_is_nothing_that_a_command_refuses(capsys: pytest.CaptureFixture[str]) -> None:
    main(["completion", "bash"])
    capsys.readouterr()
    assert parser().commands["describe"].places[0].choices is None
