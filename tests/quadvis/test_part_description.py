"""`quadvis describe FILE.yaml`: what a part takes and gives."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.cli import main
from quadvis.diagram.part_description import part_description, part_facts
from quadvis.errors import DiagramError

PI = """\
# A PI controller.
# With a limit.
quadvis: 1
name: pi
params:
  kp: 2
  limits: {value: [-1, 1], unit: V}
  motor: {group: motor.yaml}
ports:
  in: [error, {bias: 0.5}]
  out: {effort: sum.y}
blocks:
  p: {block: signal.gain, with: {factor: $kp}, in: {u: in.error}}
  sum: {block: signal.sum, in: {u: [p.y, in.bias]}}
"""


@pytest.fixture
def part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("pi.yaml").write_text(PI)
    return "pi.yaml"


def test_a_part_is_described_by_what_its_file_says(part: str) -> None:
    assert part_description(part).splitlines() == [
        "pi.yaml", "",
        "A PI controller.", "With a limit.", "",
        "inputs", "  error", "  bias   optional, 0.5", "",
        "outputs", "  effort  from sum.y", "",
        "parameters", "  kp      = 2", "  limits  = [-1 V, 1 V]", "  motor   = {group: motor.yaml}", "",
        "blocks", "  p    signal.gain", "  sum  signal.sum", "",
        "in a diagram", "  pi:", "    part: pi.yaml", "    in: {error: block.port}",
    ]  # fmt: skip


def test_the_entry_can_be_copied(part: str, tmp_path: Path) -> None:
    Path(part).write_text(PI.replace("  motor: {group: motor.yaml}\n", ""))
    entry = part_description(part).partition("in a diagram\n")[2].replace("block.port", "1.0")
    head = "quadvis: 1\nname: x\nrates: {fast: 10 Hz}\nstop_time: 1 s\nblocks:\n"
    entry = entry.replace("part: pi.yaml", "part: pi.yaml\n    rate: fast")
    assert "pi/sum" in {node.path for node in load_text(f"{head}{entry}\n", tmp_path).graph.nodes}


def test_the_same_as_data(part: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", part, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == part_facts(part)
    assert part_facts(part)["outputs"] == {"effort": "sum.y"}


def test_the_words_of_a_key_doc_come_first(part: str) -> None:
    Path(part).write_text(PI.replace("name: pi", "name: pi\ndoc: Said once."))
    assert part_description(part).splitlines()[2] == "Said once."


def test_a_long_entry_is_broken(part: str) -> None:
    Path(part).write_text(PI.replace("[error,", f"[error, {', '.join(f'long_{n}' for n in range(9))},"))
    assert "      long_8: block.port" in part_description(part).splitlines()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "pi.yaml: there is no such file"),
        (PI.replace("out:", "uot:"), "did you mean 'out'?"),
        (
            "quadvis: 1\nname: x\nrates: {a: 1 Hz}\nstop_time: 1 s\nblocks: {}\n",
            "this is a diagram, not a part",
        ),
    ],
)
def test_a_file_that_is_no_part_gets_a_sentence(part: str, text: str | None, sentence: str) -> None:
    Path(part).unlink()
    if text is not None:
        Path(part).write_text(text)
    with pytest.raises(DiagramError) as caught:
        part_description(part)
    assert sentence in str(caught.value)
