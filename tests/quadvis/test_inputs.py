"""A run uses the files that were checked: an edit after loading changes nothing, or is refused."""

import os
import shutil
import threading
from collections.abc import Callable, Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import quadvis
from quadvis.api import Diagram, load_text
from quadvis.block import Block, Frame, Out, Param, ParameterError
from quadvis.errors import QuadvisError
from quadvis.machine.inputs import file_digest, note_digest, noted_inputs, open_input, read_input, read_once
from quadvis.output.log_reader import read_log
from quadvis.sweeps import sweep as sweeping
from quadvis.sweeps import worker
from quadvis.sweeps.worker import Job, Row
from quadvis.testing import drive
from quadvis_blocks.vision.circle_detector import CircleDetector
from quadvis_blocks.vision.image_folder import ImageFolder
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the diagrams with three pictures to play."""
    copy = tmp_path / "diagrams"
    skipped = shutil.ignore_patterns("recordings", "pictures")
    shutil.copytree(DIAGRAMS, copy, ignore=skipped)
    (copy / "recordings" / "hand_held").mkdir(parents=True)
    for number in (1, 2, 3):
        name = f"hand_held/{number:06d}.jpg"
        shutil.copy(DIAGRAMS / "recordings" / name, copy / "recordings" / name)
    shutil.copy(DIAGRAMS / "recordings" / "hand_held.mp4", copy / "recordings" / "hand_held.mp4")
    return copy


def other_number(path: Path) -> None:
    path.write_text(path.read_text().replace("430", "431").replace("0.74", "0.75"))


def replaced(path: Path) -> None:
    new = path.with_name("new.yaml")
    new.write_text(path.read_text().replace("430", "500"))
    os.replace(new, path)


def garbage(path: Path) -> None:
    path.write_bytes(b"\0\xff not a calibration")


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


EDITS: dict[str, Callable[[Path], Any]] = {
    "other number": other_number,
    "replaced": replaced,
    "garbage": garbage,
    "empty": lambda path: path.write_text(""),
    "gone": Path.unlink,
    "renamed": lambda path: path.rename(path.with_name("old.yaml")),
    "pipe": pipe,
    "folder": folder,
    "its folder gone": lambda path: shutil.rmtree(path.parent),
    "touched": lambda path: os.utime(path, (0, 0)),
    "comment added": lambda path: path.write_text("# edited\n" + path.read_text()),
    "a link to itself": lambda path: (path.unlink(), path.symlink_to(path)),
}
FLIGHTS = {
    "geometric": {"variant": "geometric", "stop_time": "0.3 s"},
    "rendered": {"stop_time": "0.3 s"},
    "fused": {"variant": "fused", "stop_time": "0.2 s"},
}


def signals(diagram: Diagram, log: Path | None = None) -> dict[str, bytes]:
    result = diagram.run(log=log)
    return {name: result[name].tobytes() for name in result}


@cache
def untouched(flight: str) -> tuple[dict[str, bytes], str]:
    """Return the signals and the hash of a flight whose files nobody edits."""
    diagram = quadvis.load(DIAGRAMS / "hover.yaml", **FLIGHTS[flight])
    return signals(diagram), diagram.hash


OFTEN = ["other number", "gone", "garbage"]
SOON = [*product(["geometric"], EDITS), *product(["rendered", "fused"], OFTEN)]
LATE = [*product(["rendered", "fused"], [edit for edit in EDITS if edit not in OFTEN])]


@pytest.mark.parametrize(("flight", "edit"), mostly_slow(SOON + LATE, len(SOON)))
def test_an_edit_of_a_calibration_after_loading_changes_nothing(
    project: Path, flight: str, edit: str
) -> None:
    diagram = quadvis.load(project / "hover.yaml", **FLIGHTS[flight])
    digest = file_digest(project / "calib" / "camera.yaml")
    EDITS[edit](project / "calib" / "camera.yaml")
    found = signals(diagram, project / "run.mcap")
    log = read_log(project / "run.mcap")
    assert f"calib/camera.yaml: {digest}" in log.diagram
    assert (found, log.metadata["hash"]) == untouched(flight)


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_of_the_colours_after_loading_changes_nothing(project: Path, edit: str) -> None:
    first = signals(quadvis.load(project / "recorded.yaml", stop_time="0.2 s"))
    diagram = quadvis.load(project / "recorded.yaml", stop_time="0.2 s")
    EDITS[edit](project / "calib" / "colours.yaml")
    assert signals(diagram) == first


@pytest.mark.parametrize("edit", ["other number", "garbage", "gone", "pipe"])
def test_an_edit_of_the_planes_after_loading_changes_nothing(project: Path, edit: str) -> None:
    planes = project / "calib" / "two_planes.yaml"
    settings = {"n_points.rays": "two_planes", "n_points.calibration": str(planes)}
    first = signals(quadvis.load(project / "recorded.yaml", settings=settings, stop_time="0.2 s"))
    diagram = quadvis.load(project / "recorded.yaml", settings=settings, stop_time="0.2 s")
    EDITS[edit](planes)
    assert signals(diagram) == first


@pytest.mark.parametrize("edit", ["other number", "gone", "garbage"])
def test_an_edit_after_loading_does_not_reach_the_hash(project: Path, edit: str) -> None:
    diagram = quadvis.load(project / "hover.yaml")
    EDITS[edit](project / "calib" / "camera.yaml")
    assert diagram.hash == quadvis.load(DIAGRAMS / "hover.yaml").hash


def test_a_detector_alone_keeps_its_files_too(tmp_path: Path) -> None:
    for name in ("camera.yaml", "colours.yaml"):
        shutil.copy(DIAGRAMS / "calib" / name, tmp_path / name)
    block = CircleDetector(colours=str(tmp_path / "colours.yaml"), calibration=str(tmp_path / "camera.yaml"))
    shutil.rmtree(tmp_path)
    picture = cv2.imread(str(DIAGRAMS / "recordings" / "hand_held" / "000001.jpg"))
    assert drive(block, frame=[Frame(picture, 0.0, 1)], rate="10 Hz").status.tolist() == [0]


VIDEO_EDITS: dict[str, Callable[[Path], Any]] = {
    "one byte": lambda path: path.write_bytes(path.read_bytes()[:-1] + b"\0"),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:20000]),
    "longer": lambda path: path.write_bytes(path.read_bytes() + b"\0"),
    "gone": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "pipe": pipe,
    "folder": folder,
}


@pytest.mark.parametrize("edit", VIDEO_EDITS)
def test_a_video_that_is_not_what_it_was_is_refused(project: Path, edit: str) -> None:
    diagram = quadvis.load(project / "recorded.yaml", variant="video", stop_time="0.2 s")
    VIDEO_EDITS[edit](project / "recordings" / "hand_held.mp4")
    with pytest.raises(QuadvisError) as caught:
        diagram.run()
    said = str(caught.value)
    assert caught.value.exit_code == 2 and "\n" not in said
    assert said.startswith("block 'recording': file '") and "is not what it was" in said


def test_a_video_that_was_only_touched_plays(project: Path) -> None:
    diagram = quadvis.load(project / "recorded.yaml", variant="video", stop_time="0.2 s")
    os.utime(project / "recordings" / "hand_held.mp4", (0, 0))
    assert signals(diagram)


def same_length(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-100] ^= 1
    path.write_bytes(data)
    os.utime(path, (1, 1))


FOLDER_EDITS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "another picture": ("2.png' is changed", lambda path: cv2.imwrite(str(path), np.zeros((9, 9, 3)))),
    "one bit": ("2.png' is changed", same_length),
    "cut": ("2.png' is changed", lambda path: path.write_bytes(path.read_bytes()[:50])),
    "bytes behind": ("2.png' is changed", lambda path: path.write_bytes(path.read_bytes() + b"\0")),
    "touched": ("2.png' is changed", lambda path: os.utime(path, (0, 0))),
    "gone": ("2.png' is gone", Path.unlink),
    "renamed": ("2.png' is gone", lambda path: path.rename(path.with_name("9.png"))),
    "pipe": ("2.png' is gone", pipe),
    "folder": ("2.png' is gone", folder),
    "copied": ("4.png' is new", lambda path: shutil.copy(path, path.with_name("4.png"))),
    "put before": ("1b.png' is new", lambda path: shutil.copy(path, path.with_name("1b.png"))),
    "the whole folder gone": ("1.png' is gone", lambda path: shutil.rmtree(path.parent)),
}


def pictures(where: Path) -> Path:
    where.mkdir()
    for number in (1, 2, 3):
        picture = np.random.default_rng(number).integers(0, 256, (6, 8, 3), np.uint8)
        cv2.imwrite(str(where / f"{number}.png"), picture)
    return where


@pytest.mark.parametrize("edit", FOLDER_EDITS)
def test_a_folder_of_pictures_that_is_not_what_it_was_is_refused(tmp_path: Path, edit: str) -> None:
    block = ImageFolder(folder=str(pictures(tmp_path / "pictures")))
    said, change = FOLDER_EDITS[edit]
    change(tmp_path / "pictures" / "2.png")
    with pytest.raises(ParameterError, match="is not what it was when the diagram was loaded") as caught:
        drive(block, rate="10 Hz", steps=3)
    assert said in str(caught.value)


def test_files_that_are_not_played_may_come_and_go(tmp_path: Path) -> None:
    block = ImageFolder(folder=str(pictures(tmp_path / "pictures")), pattern="[12].png")
    (tmp_path / "pictures" / "notes.txt").write_text("new")
    (tmp_path / "pictures" / "3.png").unlink()
    assert not drive(block, rate="10 Hz", steps=2).finished.any()


def test_a_picture_that_changes_during_the_run_is_a_frame_without_pixels(tmp_path: Path) -> None:
    block = ImageFolder(folder=str(pictures(tmp_path / "pictures")))
    engine = drive(block, rate="10 Hz", steps=1).engine
    engine = type(engine)(engine.graph)
    with engine:
        engine.run(1)
        same_length(tmp_path / "pictures" / "2.png")
        shapes = []
        for _ in range(2):
            engine.run(1)
            shapes.append(engine.read("block", "frame").pixels.shape)
    assert shapes == [(0, 0, 3), (6, 8, 3)]


class Fan(Block, numeric=False):
    """A block of somebody else, which reads its file when it is opened."""

    speed = Out(doc="speed")
    curve = Param(type="file", doc="a number")
    notes = Param("", type="file", writes=True, doc="where it writes")

    def open(self) -> None:
        self._speed = float(Path(self.curve).read_text())

    def output(self) -> float:
        return self._speed


def test_a_file_that_a_block_reads_by_itself_must_be_what_it_was(tmp_path: Path) -> None:
    curve = tmp_path / "curve.txt"
    curve.write_text("3")
    (tmp_path / "notes.txt").write_text("old")
    block = Fan(curve=str(curve), notes=str(tmp_path / "notes.txt"))
    (tmp_path / "notes.txt").write_text("new")  # what is written may change
    assert drive(block, rate="1 Hz", steps=1).speed.tolist() == [3]
    curve.write_text("4")
    with pytest.raises(ParameterError, match=r"curve\.txt' is not what it was when the diagram was loaded"):
        drive(block, rate="1 Hz", steps=1)


def test_what_a_run_has_written_is_no_part_of_the_hash(project: Path) -> None:
    before = quadvis.load(project / "watch.yaml").hash
    (project.parent / "runs").mkdir()
    (project.parent / "runs" / "watch.mp4").write_bytes(b"\0\0\0 ftypmp42, an earlier video")
    assert quadvis.load(project / "watch.yaml").hash == before


def test_a_file_that_changes_between_two_blocks_is_refused(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = quadvis.document.read_yaml
    seen: list[str] = []

    def edited(path: Any, *others: Any) -> Any:
        if str(path).endswith("camera.yaml"):
            seen.append(str(path))
            if len(seen) == 2:
                other_number(Path(path))
        return read(path, *others)

    monkeypatch.setattr("quadvis.document.fields_file.read_yaml", edited)
    with pytest.raises(QuadvisError, match=r"camera\.yaml' was changed while it was being read; try again"):
        quadvis.load(project / "recorded.yaml")
    assert len(seen) >= 2


def test_a_resolved_diagram_compares_what_it_read(project: Path) -> None:
    diagram = quadvis.load(project / "hover.yaml", stop_time="0.1 s")
    again = load_text(diagram.resolved, project)
    EDITS["gone"](project / "calib" / "camera.yaml")
    assert again.hash == diagram.hash and signals(again) == signals(diagram)


def test_a_diagram_knows_every_file_that_it_was_read_from(project: Path) -> None:
    diagram = quadvis.load(project / "recorded.yaml")
    found = {str(Path(path).relative_to(project)) for path in diagram.files}
    assert found == {"recorded.yaml", "calib/camera.yaml", "calib/colours.yaml", "recordings/hand_held"}
    hover = quadvis.load(project / "hover.yaml", variant="fused", params=project / "sets" / "s1.yaml")
    found = {str(Path(path).relative_to(project)) for path in hover.files}
    assert {"hover.yaml", "parts/fused_control.yaml", "calib/camera.yaml", "sets/s1.yaml"} <= found


@pytest.fixture
def edited_after_planning(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Callable[[], Any]]]:
    """Do the runs in this process as fresh workers would, after an edit that a test puts into the list."""
    edits: list[Callable[[], Any]] = []

    def in_turn(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        for edit in edits:
            edit()
        for job in jobs:
            worker._loaded = None
            yield worker.perform(job)

    monkeypatch.setattr(sweeping, "perform_all", in_turn)
    yield edits
    worker._loaded = None


@pytest.mark.parametrize(
    ("name", "diagram"),
    [("calib/camera.yaml", "hover.yaml"), ("hover.yaml", "hover.yaml"),
     ("parts/geometric_eyes.yaml", "hover.yaml"),
     ("sets/s1.yaml", "hover.yaml"), ("calib/colours.yaml", "recorded.yaml"),
     ("recordings/hand_held/000002.jpg", "recorded.yaml")],
)  # fmt: skip
def test_an_edit_after_a_sweep_began_is_a_row_with_the_reason(
    project: Path, edited_after_planning: list[Callable[[], Any]], name: str, diagram: str
) -> None:
    given: dict[str, Any] = {"variant": "geometric"} if diagram == "hover.yaml" else {}
    given |= {"params": project / "sets" / "s1.yaml"} if name.startswith("sets") else {}
    over = {"seed": range(2)}
    table = quadvis.sweep(project / diagram, over, stop_time="0 s", **given)
    assert table["failure"].tolist() == ["", ""]

    def edit() -> None:
        with (project / name).open("ab") as file:
            file.write(b"\n")

    edited_after_planning.append(edit)
    table = quadvis.sweep(project / diagram, over, stop_time="0 s", **given)
    for failure in table["failure"].tolist():
        assert failure.endswith("is not what it was when the sweep began; sweep again")
        assert name in failure or os.path.dirname(name) + "/'" in failure
    assert not table["passed"].any()


def test_files_that_are_read_are_noted_once(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"first")
    with noted_inputs() as outer:
        assert read_input(path) == b"first" and read_input(str(path)) == b"first"
        digest = file_digest(path)
        with noted_inputs() as inner:
            note_digest("b", "second")
        note_digest("c", "xyz")
        path.write_bytes(b"other")
        with pytest.raises(QuadvisError, match="was changed while it was being read"):
            read_input(path)
    assert outer == {str(path): digest, "c": "xyz"} and list(inner) == ["b"]
    assert read_input(path) == b"other"


def test_what_a_function_reads_from_a_file_is_shared_while_inputs_are_noted(tmp_path: Path) -> None:
    read: list[str] = []

    def contents(path: str) -> list[bytes]:
        read.append(path)
        return [read_input(path)]

    path = str(tmp_path / "a")
    with noted_inputs() as found:
        with pytest.raises(QuadvisError):
            read_once(contents, path)
        Path(path).write_bytes(b"x")
        first = read_once(contents, path)
        assert read_once(contents, path) is first and first == [b"x"]
        assert read_once(lambda path: contents(path) * 2, path) == [b"x", b"x"]  # another function
    assert list(found) == [path] and read == [path] * 3
    assert read_once(contents, path) is not read_once(contents, path)


def test_every_thread_notes_for_itself(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x")
    with noted_inputs() as found:
        thread = threading.Thread(target=read_input, args=(tmp_path / "a",))
        thread.start()
        thread.join()
    assert found == {}


@pytest.mark.parametrize("reading", [read_input, file_digest, open_input])
def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path, reading: Callable[[Any], Any]) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    cases = {
        tmp_path / "pipe": "a device or a pipe",
        "/dev/zero": "a device or a pipe",
        "/dev/null": "a device or a pipe",
        tmp_path: "a folder",
        tmp_path / "absent": "no such file",
        tmp_path / "loop": "cannot read",
        tmp_path / "pipe" / "a": "cannot read",
        f"{tmp_path}/a\0b": "cannot read",
        tmp_path / ("x" * 300): "cannot read",
        "": "no such file",
    }
    for path, said in cases.items():
        with pytest.raises(QuadvisError, match=r"^cannot read") as caught:
            reading(path)
        assert said in str(caught.value)


def test_a_file_that_is_too_long_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(bytes(11))
    assert len(read_input(tmp_path / "a", most=11)) == 11
    with pytest.raises(QuadvisError, match="more than 1e-05 MB"):
        read_input(tmp_path / "a", most=10)
