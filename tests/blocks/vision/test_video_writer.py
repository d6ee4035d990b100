"""vision.video_writer"""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Frame, ParameterError
from quadvis.errors import RunError
from quadvis.machine.files import Kind, open_output, reading
from quadvis.testing import drive
from quadvis_blocks.vision.video_file import VideoFile
from quadvis_blocks.vision.video_writer import CODECS, VideoWriter, frame_rate


def frames(count, shape=(48, 64, 3)):
    """Smooth pictures of one colour each, which every codec keeps within a few grey levels."""
    random = np.random.default_rng(3)
    colours = random.integers(30, 226, (count, 3))
    return [Frame(np.full(shape, colour, np.uint8), 0.1 * i, i + 1) for i, colour in enumerate(colours)]


def read(path):
    """Return the pictures of a video by OpenCV, and its frames/s."""
    video = cv2.VideoCapture(str(path))
    pictures = []
    while (read := video.read())[0]:
        pictures.append(read[1])
    return pictures, video.get(cv2.CAP_PROP_FPS)


@pytest.mark.parametrize("suffix", CODECS)
def test_opencv_reads_what_is_written(tmp_path, suffix):
    sent, path = frames(7), tmp_path / "new" / f"video{suffix}"
    drive(VideoWriter(file=str(path)), frame=sent, rate="12.5 Hz")
    pictures, rate = read(path)
    assert rate == pytest.approx(12.5)
    assert len(pictures) == 7
    for frame, got in zip(sent, pictures, strict=True):
        assert np.abs(frame.pixels.astype(int) - got).max() <= 8


def test_mkv_keeps_every_bit_and_video_file_plays_it_again(tmp_path):
    random = np.random.default_rng(5)
    sent = [Frame(random.integers(0, 256, (48, 64, 3), np.uint8), 0.1 * i, i + 1) for i in range(6)]
    path = str(tmp_path / "video.mkv")
    # Each frame stays on the wire for two ticks, and the first tick has none.
    wire = [Frame.none(), *np.repeat(np.array(sent, object), 2)]
    drive(VideoWriter(file=path, keep_time=False), frame=wire, rate="10 Hz")
    played = drive(VideoFile(file=path), rate="10 Hz", steps=7)
    assert played.finished.tolist() == [False] * 6 + [True]
    assert all(np.array_equal(a.pixels, b.pixels) for a, b in zip(sent, played.frame[:6], strict=True))


def test_a_second_of_the_video_is_a_second_of_the_run(tmp_path):
    a, b = frames(2)
    path = tmp_path / "video.mkv"
    drive(VideoWriter(file=str(path)), frame=[Frame.none(), Frame.none(), a, a, a, b, b], rate="10 Hz")
    pictures, _ = read(path)
    wanted = [np.zeros_like(a.pixels)] * 2 + [a.pixels] * 3 + [b.pixels] * 2
    assert np.array_equal(pictures, wanted)


def test_odd_sizes_are_made_even_by_repeating_the_border(tmp_path):
    random = np.random.default_rng(5)
    pixels = random.integers(0, 256, (47, 63, 3), np.uint8)
    path = tmp_path / "video.mkv"
    drive(VideoWriter(file=str(path)), frame=[Frame(pixels, 0.0, 1)])
    (picture,), _ = read(path)
    assert np.array_equal(picture, np.pad(pixels, ((0, 1), (0, 1), (0, 0)), mode="edge"))


def test_a_frame_of_another_size_is_fitted_and_one_that_is_no_picture_is_black(tmp_path):
    first, large, *_ = (*frames(1, (40, 80, 3)), *frames(1, (400, 400, 3)))
    other = Frame(large.pixels, 0.1, 2)
    broken = Frame(np.zeros((0, 0, 3), np.uint8), 0.2, 3)
    wrong = Frame(np.zeros((40, 80)), 0.3, 4)  # type: ignore[arg-type]
    path = tmp_path / "video.mkv"
    drive(VideoWriter(file=str(path)), frame=[broken, first, other, wrong])
    pictures, _ = read(path)
    assert len(pictures) == 4
    assert not pictures[0].any() and not pictures[3].any()
    assert (pictures[2][:, 20:60] == large.pixels[0, 0]).all()
    assert not pictures[2][:, :20].any() and not pictures[2][:, 60:].any()


def test_a_file_that_is_there_is_replaced(tmp_path):
    path = tmp_path / "video.avi"
    for count in (9, 3):
        drive(VideoWriter(file=str(path)), frame=frames(count))
    assert len(read(path)[0]) == 3


@pytest.mark.parametrize("suffix", CODECS)
def test_a_file_of_another_kind_stays_and_so_does_one_that_is_read(tmp_path, suffix):
    path, other = tmp_path / f"video{suffix}", tmp_path / "other"
    path.write_text("quadvis: 1\n")
    with pytest.raises(ParameterError, match=r"cannot write the video .* a file of another kind is there"):
        drive(VideoWriter(file=str(path)), frame=frames(2))
    assert path.read_text() == "quadvis: 1\n"
    path.unlink()
    drive(VideoWriter(file=str(path)), frame=frames(2))
    other.symlink_to(path)
    before = path.read_bytes()
    with reading([other]), pytest.raises(ParameterError, match=r"it is an input .*other"):
        drive(VideoWriter(file=str(path)), frame=frames(2))
    assert path.read_bytes() == before


def test_a_video_that_another_run_writes_stays_whole(tmp_path):
    path = tmp_path / "video.mkv"
    sent = frames(3)
    held = open_output(path, Kind("the video"))
    with pytest.raises(RunError, match="another run is writing it"):
        drive(VideoWriter(file=str(path)), frame=sent)
    held.close()
    drive(VideoWriter(file=str(path)), frame=sent)
    assert len(read(path)[0]) == 3


@pytest.mark.parametrize("name", ["video", "video.webm", "video.png"])
def test_an_unknown_format_is_refused(tmp_path, name):
    with pytest.raises(ParameterError, match=r"file must end in one of \.mp4, \.avi, \.mkv"):
        VideoWriter(file=str(tmp_path / name))


def test_a_folder_in_place_of_the_file_is_refused(tmp_path):
    (tmp_path / "video.mp4").mkdir()
    with pytest.raises(ParameterError, match="is a folder"):
        VideoWriter(file=str(tmp_path / "video.mp4"))


def test_a_folder_that_cannot_be_made_stops_the_run_with_a_sentence(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RunError, match="cannot make the folder"):
        drive(VideoWriter(file=str(tmp_path / "file" / "video.mp4")), frame=frames(1))


def test_a_video_that_cannot_be_begun_stops_the_run_with_a_sentence(tmp_path):
    with pytest.raises(RunError, match="cannot write the video"):
        # Nothing that OpenCV writes as MPEG-4 has one picture in three hours.
        drive(VideoWriter(file=str(tmp_path / "video.mp4")), frame=frames(1), rate="10000 s")


@given(rate=st.floats(0.2, 2000))
def test_the_rate_is_one_that_mpeg_4_can_say(rate):
    said = frame_rate(1 / rate)
    assert said == pytest.approx(rate, rel=3e-3)
    digits = next(d for d in range(4) if round(said, d) == said)
    assert said * 10**digits <= 65535
