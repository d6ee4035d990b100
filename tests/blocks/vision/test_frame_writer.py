"""vision.frame_writer"""

import numpy as np
import pytest

from quadvis.block import Frame, ParameterError
from quadvis.machine.files import reading
from quadvis.testing import drive
from quadvis_blocks.vision.frame_writer import FrameWriter
from quadvis_blocks.vision.image_folder import ImageFolder


def frames(count):
    random = np.random.default_rng(3)
    return [Frame(random.integers(0, 256, (12, 16, 3), np.uint8), 0.1 * i, i + 1) for i in range(count)]


def test_what_is_written_is_played_again_to_the_bit(tmp_path):
    sent = frames(12)
    # Each frame stays on the wire for two ticks, and the first tick has none.
    drive(FrameWriter(folder=str(tmp_path)), frame=[Frame.none(), *np.repeat(np.array(sent, object), 2)])
    assert len(list(tmp_path.iterdir())) == 12
    played = drive(ImageFolder(folder=str(tmp_path)), rate="10 Hz", steps=12).frame
    assert all(np.array_equal(a.pixels, b.pixels) for a, b in zip(sent, played, strict=True))


def test_one_out_of_so_many_is_written(tmp_path):
    drive(FrameWriter(folder=str(tmp_path), every=5, format="jpg"), frame=frames(12))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["000001.jpg", "000006.jpg", "000011.jpg"]


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match="folder must be a folder"):
        FrameWriter(folder=str(tmp_path / "file"))


def test_a_picture_that_cannot_be_written_stops_the_run_with_a_sentence(tmp_path):
    (tmp_path / "000001.png").mkdir()
    with pytest.raises(ParameterError, match=r"cannot write the picture .*000001.png.*it is a folder"):
        drive(FrameWriter(folder=str(tmp_path)), frame=frames(1))


def test_files_of_another_kind_stay(tmp_path):
    (tmp_path / "000002.png").write_text("notes")
    (tmp_path / "000001.png.txt").write_text("notes")
    with pytest.raises(ParameterError, match=r"cannot write the picture .*000002.png.*of another kind"):
        drive(FrameWriter(folder=str(tmp_path)), frame=frames(3))
    assert {path.name for path in tmp_path.iterdir()} == {"000001.png.txt", "000002.png"}
    assert (tmp_path / "000002.png").read_text() == "notes"


def test_pictures_of_an_earlier_run_are_replaced_but_never_one_that_is_read(tmp_path):
    folder, played = tmp_path / "out", tmp_path / "played.png"
    drive(FrameWriter(folder=str(folder)), frame=frames(3))
    drive(FrameWriter(folder=str(folder)), frame=frames(4))
    assert len(list(folder.iterdir())) == 4
    played.hardlink_to(folder / "000002.png")
    before = played.read_bytes()
    with reading([played]), pytest.raises(ParameterError, match="is an input"):
        drive(FrameWriter(folder=str(folder)), frame=frames(3))
    assert played.read_bytes() == before
