"""The only reader of pictures: what it reads, what it ignores in a file, and what it refuses."""

import os
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.errors import QuadvisError
from quadvis.machine.inputs import MOST_BYTES
from quadvis.testing import drive
from quadvis_blocks.vision.image_folder import ImageFolder
from quadvis_blocks.vision.video_file import VideoFile
from quadvis_vision.pictures.reader import CodedPicture, open_video, read_coded, turned_note

SIZE = (40, 24)  # width and height of all that is made here, unless said


def colours() -> np.ndarray:
    """Return a picture (24, 40, 3) with every kind of gradient and some noise."""
    v, u = np.indices(SIZE[::-1])
    noise = np.random.default_rng(0).integers(0, 40, SIZE[::-1])
    return np.stack((5 * u, 8 * v, 90 + noise), axis=-1).astype(np.uint8)


def coded(suffix: str, pixels: np.ndarray | None = None, *options: int) -> bytes:
    return cv2.imencode(suffix, colours() if pixels is None else pixels, list(options))[1].tobytes()


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(size: tuple[int, int], depth: int, colour: int, rows: list[bytes], *before: bytes) -> bytes:
    """Return a PNG of these rows of samples; `before` are chunks before the data."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", *size, depth, colour, 0, 0, 0))
    data = chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows)))
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(before) + data + chunk(b"IEND", b"")


def exif(orientation: int, order: str = ">") -> bytes:
    """Return an EXIF block that asks for an orientation."""
    letters = b"MM" if order == ">" else b"II"
    return letters + struct.pack(f"{order}HIHHHIHHI", 42, 8, 1, 274, 3, 1, orientation, 0, 0)


def tiff(pixels: np.ndarray, orientation: int, order: str, kind: int = 3) -> bytes:
    """Return a TIFF of grey pixels, uncompressed, with an orientation of type SHORT or LONG."""
    height, width = pixels.shape
    field = {3: "HH", 4: "I"}[kind]
    value = struct.pack(order + field, *([orientation, 0] if kind == 3 else [orientation]))
    tags = [(256, 4, width), (257, 4, height), (258, 4, 8), (259, 4, 1), (262, 4, 1), (273, 4, 8),
            (274, kind, value), (278, 4, height), (279, 4, pixels.size)]  # fmt: skip
    entries = b"".join(
        struct.pack(f"{order}HHI", tag, kind, 1)
        + (value if isinstance(value, bytes) else struct.pack(f"{order}I", value))
        for tag, kind, value in tags
    )
    start = 8 + pixels.size + pixels.size % 2
    head = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HI", 42, start)
    directory = struct.pack(f"{order}H", len(tags)) + entries + bytes(4)
    return head + pixels.tobytes().ljust(start - 8, b"\0") + directory


def webp_with_exif(orientation: int) -> bytes:
    still = coded(".webp", None, cv2.IMWRITE_WEBP_QUALITY, 101)[12:]
    canvas = b"\x08\0\0\0" + struct.pack("<I", SIZE[0] - 1)[:3] + struct.pack("<I", SIZE[1] - 1)[:3]
    block = exif(orientation)
    body = b"WEBPVP8X" + struct.pack("<I", 10) + canvas + still
    body += b"EXIF" + struct.pack("<I", len(block)) + block
    return b"RIFF" + struct.pack("<I", len(body)) + body


def jpeg_with_exif(orientation: int, data: bytes | None = None) -> bytes:
    block = b"Exif\0\0" + exif(orientation)
    app1 = b"\xff\xe1" + struct.pack(">H", 2 + len(block)) + block
    plain = coded(".jpg") if data is None else data
    return plain[:2] + app1 + plain[2:]


def png_with_exif(orientation: int) -> bytes:
    plain = coded(".png")
    return plain[:33] + chunk(b"eXIf", exif(orientation)) + plain[33:]


WHOLE = {
    "png": coded(".png"),
    "grey png": coded(".png", colours()[..., 0]),
    "jpg": coded(".jpg"),
    "progressive jpg": coded(".jpg", None, cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    "jpg with restarts": coded(".jpg", None, cv2.IMWRITE_JPEG_RST_INTERVAL, 1),
    "jpg with a picture in its tags": jpeg_with_exif(1, jpeg_with_exif(1)),
    "bmp": coded(".bmp"),
    "grey bmp": coded(".bmp", colours()[..., 0]),
    "tiff": coded(".tiff"),
    "ppm": coded(".ppm"),
    "pgm": coded(".pgm", colours()[..., 0]),
    "webp": coded(".webp"),
    "lossless webp": coded(".webp", None, cv2.IMWRITE_WEBP_QUALITY, 101),
}
BEHIND = {
    "zeros": bytes(512),
    "one byte": b"x",
    "noise": np.random.default_rng(1).bytes(3000),
    "a line": b"\r\nend of file\r\n",
    "markers": b"\xff\xd8\xff\xd9\xff\xda" * 9,
    "a png": coded(".png", 255 - colours()),
    "a jpg": coded(".jpg", 255 - colours()),
    "half a png": coded(".png", 255 - colours())[:300],
    "half a jpg": coded(".jpg", 255 - colours())[:300],
    "a chunk": chunk(b"IDAT", zlib.compress(bytes(99))),
}


def read(folder: Path, data: bytes, name: str = "picture.png") -> CodedPicture:
    (folder / name).write_bytes(data)
    return read_coded(folder / name)


def refused(folder: Path, data: bytes) -> str:
    """Return the one sentence about a file, which begins with its path."""
    with pytest.raises(QuadvisError) as caught:
        read(folder, data).decode()
    said = str(caught.value)
    assert said.startswith(str(folder / "picture.png")) and "\n" not in said
    return said


@pytest.mark.parametrize("kind", WHOLE)
def test_a_whole_picture_is_what_the_decoder_makes_of_it(tmp_path: Path, kind: str) -> None:
    found = read(tmp_path, WHOLE[kind])
    assert found.size == SIZE and not found.turned
    for flags, grey in ((cv2.IMREAD_COLOR, False), (cv2.IMREAD_GRAYSCALE, True)):
        wanted = cv2.imdecode(np.frombuffer(WHOLE[kind], np.uint8), flags)
        assert np.array_equal(found.decode(grey=grey), wanted)
    assert found.decode().dtype == np.uint8


@pytest.mark.parametrize("behind", BEHIND)
@pytest.mark.parametrize("kind", WHOLE)
def test_bytes_behind_the_end_are_ignored(tmp_path: Path, kind: str, behind: str) -> None:
    found = read(tmp_path, WHOLE[kind] + BEHIND[behind])
    assert np.array_equal(found.decode(), read(tmp_path, WHOLE[kind]).decode())


SHARES = [0.05, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0]


def first_part(data: bytes, share: float) -> bytes:
    return data[: min(int(len(data) * share), len(data) - 1)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("kind", WHOLE)
def test_a_picture_that_is_cut_is_refused(tmp_path: Path, kind: str, share: float) -> None:
    said = refused(tmp_path, first_part(WHOLE[kind], share))
    assert "is cut short" in said or "is damaged" in said


@pytest.mark.parametrize("filled", [bytes(4000), b"\xff" * 9, b"\n"])
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("kind", [kind for kind in WHOLE if "png" in kind or "jpg" in kind])
def test_a_cut_png_or_jpg_that_was_filled_up_is_refused(
    tmp_path: Path, kind: str, share: float, filled: bytes
) -> None:
    said = refused(tmp_path, first_part(WHOLE[kind], share) + filled)
    assert "is cut short" in said or "is damaged" in said


@pytest.mark.parametrize("kind", ["jpg", "progressive jpg", "png", "grey png"])
def test_a_cut_picture_that_another_one_follows_is_refused(tmp_path: Path, kind: str) -> None:
    refused(tmp_path, WHOLE[kind][:-60] + WHOLE[kind])


@pytest.mark.parametrize("place", [20, 40, 60, 100, 300])
def test_a_png_with_a_changed_byte_is_refused(tmp_path: Path, place: int) -> None:
    data = bytearray(WHOLE["png"])
    data[place] ^= 4
    assert "is damaged" in refused(tmp_path, bytes(data))


def test_a_png_with_too_few_rows_is_refused(tmp_path: Path) -> None:
    assert "is damaged" in refused(tmp_path, png((8, 8), 8, 0, [bytes(8)] * 4))


@pytest.mark.parametrize("orientation", range(2, 9))
@pytest.mark.parametrize("make", [jpeg_with_exif, png_with_exif, webp_with_exif])
def test_the_orientation_that_a_file_asks_for_is_noted_and_ignored(
    tmp_path: Path, make: object, orientation: int
) -> None:
    found, upright = read(tmp_path, make(orientation)), read(tmp_path, make(1))  # type: ignore[operator]
    assert found.turned and not upright.turned
    assert found.size == SIZE
    for grey in (False, True):
        assert np.array_equal(found.decode(grey=grey), upright.decode(grey=grey))


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [3, 4])
def test_the_orientation_of_a_tiff_is_ignored_too(
    tmp_path: Path, orientation: int, order: str, kind: int
) -> None:
    pixels = colours()[..., 0].copy()
    found = read(tmp_path, tiff(pixels, orientation, order, kind))
    assert found.turned == (orientation > 1)
    assert np.array_equal(found.decode(grey=True), pixels)


@pytest.mark.parametrize("orientation", [0, 1, 9, 65535])
def test_an_orientation_that_there_is_not_asks_for_nothing(tmp_path: Path, orientation: int) -> None:
    assert not read(tmp_path, jpeg_with_exif(orientation)).turned


@pytest.mark.parametrize("length", [0, 1, 7, 8, 12, 18])
def test_a_damaged_exif_block_asks_for_nothing(tmp_path: Path, length: int) -> None:
    block = b"Exif\0\0" + exif(6)[:length]
    plain = coded(".jpg")
    data = plain[:2] + b"\xff\xe1" + struct.pack(">H", 2 + len(block)) + block + plain[2:]
    assert not read(tmp_path, data).turned


def test_turned_pictures_are_told_in_one_note(tmp_path: Path) -> None:
    plain = read(tmp_path, coded(".jpg"), "a.jpg")
    turned = [read(tmp_path, jpeg_with_exif(6), name) for name in ("b.jpg", "c.jpg")]
    assert turned_note([plain]) == []
    (note,) = turned_note([plain, *turned])
    assert note.startswith("b.jpg, c.jpg ask to be turned") and "as the sensor gave them" in note


PALETTE = chunk(b"PLTE", bytes([1, 2, 3, 4, 5, 6]))


@pytest.mark.parametrize(
    ("data", "pixels"),
    [
        (png((2, 1), 8, 0, [bytes([50, 200])]), [[50] * 3, [200] * 3]),
        (png((2, 1), 8, 0, [bytes([50, 200])], chunk(b"tRNS", b"\0\x32")), [[50] * 3, [200] * 3]),
        (png((2, 1), 8, 0, [bytes([50, 200])], chunk(b"gAMA", b"\0\1\x86\xa0")), [[50] * 3, [200] * 3]),
        (png((2, 1), 8, 4, [bytes([9, 0, 77, 128])]), [[9] * 3, [77] * 3]),
        (png((2, 1), 8, 6, [bytes([1, 2, 3, 0, 4, 5, 6, 255])]), [[3, 2, 1], [6, 5, 4]]),
        (png((2, 1), 8, 3, [bytes([1, 0])], PALETTE), [[6, 5, 4], [3, 2, 1]]),
        (png((2, 1), 8, 3, [bytes([1, 0])], PALETTE, chunk(b"tRNS", b"\0\0")), [[6, 5, 4], [3, 2, 1]]),
        (png((2, 1), 4, 0, [b"\x0f"]), [[0] * 3, [255] * 3]),
        (png((2, 1), 1, 0, [b"\x40"]), [[0] * 3, [255] * 3]),
        (png((2, 1), 16, 0, [bytes([0x12, 0xFF, 0xFF, 0xFE])]), [[0x12] * 3, [0xFF] * 3]),
        (png((2, 1), 16, 2, [bytes(range(12))]), [[4, 2, 0], [10, 8, 6]]),
        (png((2, 1), 16, 6, [bytes(range(16))]), [[4, 2, 0], [12, 10, 8]]),
        (b"P5\n2 1\n255\n" + bytes([50, 200]), [[50] * 3, [200] * 3]),
        (b"P5 # 9 9 \n2\t1 # x\n255\n" + bytes([50, 200]), [[50] * 3, [200] * 3]),
        (b"P5 2 1 65535\n" + bytes([0x12, 0xFF, 0xFF, 0xFE]), [[0x12] * 3, [0xFF] * 3]),
        (b"P6 2 1 255\n" + bytes([1, 2, 3, 4, 5, 6]), [[3, 2, 1], [6, 5, 4]]),
        (b"P4 2 1\n\x80", [[0] * 3, [255] * 3]),
        (tiff(np.array([[50, 200]], np.uint8), 1, ">"), [[50] * 3, [200] * 3]),
        (coded(".bmp", np.array([[[1, 2, 3, 0], [4, 5, 6, 255]]], np.uint8)), [[1, 2, 3], [4, 5, 6]]),
        (coded(".tiff", np.array([[0x12FF, 0xFFFE]], np.uint16)), [[0x12] * 3, [0xFF] * 3]),
    ],
)
def test_every_depth_and_kind_of_colour_becomes_three_channels(
    tmp_path: Path, data: bytes, pixels: list[list[int]]
) -> None:
    assert read(tmp_path, data).decode().tolist() == [pixels]


ANIMATED = png((2, 1), 8, 0, [bytes(2)], chunk(b"acTL", struct.pack(">II", 2, 0)))
MOVING = b"RIFF" + struct.pack("<I", 30) + b"WEBPVP8X" + struct.pack("<I", 10) + b"\2" + bytes(40)
INKS = coded(".jpg").replace(b"\x03\x01\x22\x00", b"\x04\x01\x22\x00")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "is not a picture: it is empty"),
        (b"this is not a picture\n", "is not a picture"),
        (b"root:x:0:0:root\n", "is not a picture"),
        (b"BMW is a make of cars", "is not a picture"),
        (b"GIF89a" + bytes(99), "is a GIF"),
        (b"P2 2 1 255\n1 2\n", "in the form of text"),
        (b"P5 2 1 4095\n" + bytes(4), "4095 for its brightest value"),
        (b"P5 2 one 255\n" + bytes(4), "is damaged"),
        (b"II+\0" + bytes(99), "BigTIFF"),
        (ANIMATED, "animation"),
        (MOVING, "animation"),
        (INKS, "CMYK"),
        (coded(".jpg").replace(b"\xff\xc0", b"\xff\xff"), "is damaged"),
        (png((0, 3), 8, 0, [b""] * 3), "declares 0 x 3 px"),
        (b"\0\0\0\x18ftypheic" + bytes(99), "is not a picture"),
    ],
)  # fmt: skip
def test_what_has_no_defined_pixels_is_refused_in_one_sentence(
    tmp_path: Path, data: bytes, said: str
) -> None:
    assert said in refused(tmp_path, data)


def declaring(kind: str, width: int, height: int) -> bytes:
    """Return a small whole file that declares this size of a picture."""
    if kind == "png":
        return png((width, height), 8, 2, [bytes(9)])
    if kind == "jpg":
        data = coded(".jpg")
        return data.replace(struct.pack(">HH", *SIZE[::-1]), struct.pack(">HH", height, width))
    if kind == "bmp":
        return coded(".bmp")[:18] + struct.pack("<ii", width, -height) + coded(".bmp")[26:]
    if kind == "tiff":
        data = tiff(np.zeros((1, 1), np.uint8), 1, "<")
        for tag, value in ((256, width), (257, height)):
            entry = struct.pack("<HHI", tag, 4, 1)
            at = data.index(entry) + 8
            data = data[:at] + struct.pack("<I", value) + data[at + 4 :]
        return data
    if kind == "pgm":
        return b"P5 %d %d 255\n" % (width, height) + bytes(100)
    canvas = struct.pack("<I", width - 1)[:3] + struct.pack("<I", height - 1)[:3]
    body = b"WEBPVP8X" + struct.pack("<I", 10) + bytes(4) + canvas + coded(".webp")[12:]
    return b"RIFF" + struct.pack("<I", len(body)) + body


@pytest.mark.parametrize("kind", ["png", "jpg", "bmp", "tiff", "pgm", "webp"])
@pytest.mark.parametrize("size", [(30_000, 30_000), (65_000, 1_000), (8_001, 8_000), (16_000, 16_000)])
def test_a_huge_picture_costs_no_more_than_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, size: tuple[int, int]
) -> None:
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("a huge picture was decoded"))
    said = refused(tmp_path, declaring(kind, *size))
    if kind not in ("bmp", "pgm"):  # those must be as long as they are large
        assert f"declares {size[0]} x {size[1]} px" in said and "at most 64 million" in said


def test_a_file_of_many_gigabytes_is_refused_by_its_length(tmp_path: Path) -> None:
    with (tmp_path / "picture.png").open("wb") as file:
        file.write(WHOLE["png"][:30])
        file.truncate(MOST_BYTES + 1)
    with pytest.raises(QuadvisError, match=r"picture\.png': it has more than 256 MB"):
        read_coded(tmp_path / "picture.png")


@pytest.mark.parametrize(
    "name",
    ["grün.png", "снимок.png", "写真.png", "a b.png", "new\nline.png", "%d.png", "a'\".png", "🚁.png",
     os.fsdecode(b"raw\xff\xfe.png"), "x" * 250 + ".png", "-.png", "#?*.png"],
)  # fmt: skip
def test_a_name_of_any_characters_is_read(tmp_path: Path, name: str) -> None:
    assert read(tmp_path, WHOLE["png"], name).decode().shape == (24, 40, 3)


def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "lost.png").symlink_to("nowhere")
    (tmp_path / "round.png").symlink_to("round.png")
    for name, said in {
        "pipe.png": "a device or a pipe",
        "folder.png": "a folder",
        "lost.png": "no such file",
        "absent.png": "no such file",
        "round.png": "cannot read",
        "a\0b.png": "cannot read",
        "y" * 300: "cannot read",
        "pipe.png/a.png": "cannot read",
    }.items():
        with pytest.raises(QuadvisError, match=r"^cannot read") as caught:
            read_coded(tmp_path / name)
        assert said in str(caught.value)
    with pytest.raises(QuadvisError, match="a device or a pipe"):
        read_coded("/dev/zero")


@pytest.mark.parametrize("kind", WHOLE)
def test_the_block_that_plays_pictures_reads_them_alike(tmp_path: Path, kind: str) -> None:
    (tmp_path / "1.png").write_bytes(WHOLE[kind] + bytes(512))
    (tmp_path / "2.png").write_bytes(WHOLE[kind][: len(WHOLE[kind]) // 2])
    (tmp_path / "3.png").write_bytes(jpeg_with_exif(6))
    (tmp_path / "4.png").write_bytes(declaring("png", 30_000, 30_000))
    (tmp_path / "5.png").write_bytes(WHOLE[kind])
    frames = drive(ImageFolder(folder=str(tmp_path)), rate="10 Hz", steps=5).frame
    shapes = [frame.pixels.shape for frame in frames]
    assert shapes == [(24, 40, 3), (0, 0, 3), (24, 40, 3), (0, 0, 3), (24, 40, 3)]
    assert np.array_equal(frames[0].pixels, frames[4].pixels)
    assert [frame.sequence for frame in frames] == [1, 2, 3, 4, 5]


def test_only_files_are_played(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "1.png")
    (tmp_path / "2.png").mkdir()
    (tmp_path / "3.png").write_bytes(WHOLE["png"])
    driven = drive(ImageFolder(folder=str(tmp_path)), rate="10 Hz", steps=2)
    assert [frame.pixels.shape for frame in driven.frame] == [(24, 40, 3)] * 2
    assert driven.finished.tolist() == [False, True]


def test_a_video_that_is_no_file_or_none_is_refused_in_one_sentence(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mp4")
    (tmp_path / "note.mp4").write_text("not a video")
    (tmp_path / "empty.mp4").touch()
    for name, said in {
        "pipe.mp4": "a device or a pipe",
        "note.mp4": "is not a video",
        "empty.mp4": "is not a video",
        ".": "a folder",
    }.items():
        with pytest.raises(QuadvisError, match=said):
            open_video(tmp_path / name)
    with pytest.raises(ParameterError, match=r"pipe\.mp4' is not a file"):
        VideoFile(file=str(tmp_path / "pipe.mp4"))
