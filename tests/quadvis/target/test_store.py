import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis.errors import QuadvisError
from quadvis.host.packing import pack
from quadvis.target.admission import admit
from quadvis.target.bundle import FORMAT, ApplicationBundle, inner_path
from quadvis.target.store import MOST_BYTES, PARTLY, Store

ROOT = Path(__file__).resolve().parents[3]
HOVER = ROOT / "diagrams" / "hover.yaml"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    made = Store(tmp_path / "state")
    yield made
    made.close()


def digest_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def sent(store: Store, path: Path, **more: str) -> ApplicationBundle:
    """Send a diagram into a store, as a host does."""
    bundle, paths = pack(quadvis.load(path, **more))
    for digest in store.missing(bundle.files.values()):
        data = paths[digest].read_bytes()
        assert store.put(digest, len(data), 0, data) == len(data)
    store.add(bundle)
    return bundle


@pytest.mark.parametrize("variant", [None, "fused", "geometric"])
def test_a_diagram_is_the_same_on_the_target(store: Store, variant: str | None) -> None:
    diagram = quadvis.load(HOVER, variant=variant)
    bundle = sent(store, HOVER, **({"variant": variant} if variant else {}))
    found = admit(store.bundle(bundle.name), store.place(bundle))
    assert found.hash == diagram.hash
    assert store.applications == [bundle.name]
    assert store.missing(bundle.files.values()) == []


def test_files_above_the_diagram_stay_above_it(store: Store, tmp_path: Path) -> None:
    (tmp_path / "flights").mkdir()
    (tmp_path / "calib").mkdir()
    for name in ("camera", "colours"):
        (tmp_path / "calib" / f"{name}.yaml").write_bytes((HOVER.parent / f"calib/{name}.yaml").read_bytes())
    diagram = tmp_path / "flights" / "up.yaml"
    diagram.write_text(quadvis.load(HOVER).resolved.replace("calib/", "../calib/"))
    bundle = sent(store, diagram)
    assert bundle.place == "flights/up.yaml"
    assert set(bundle.files) == {"calib/camera.yaml", "calib/colours.yaml"}
    assert admit(store.bundle("hover"), store.place(bundle)).hash == bundle.hash


def test_a_file_comes_in_pieces_and_is_checked(store: Store) -> None:
    data = bytes(range(256)) * 40
    digest = digest_of(data)
    assert store.missing([digest]) == [digest]
    for offset in range(0, len(data), 1000):
        store.put(digest, len(data), offset, data[offset : offset + 1000])
    assert store.missing([digest]) == []
    assert store.contents(digest) == data
    assert store.put(digest, len(data), 500, b"anything") == len(data)  # it is there


@pytest.mark.parametrize(
    ("size", "offset", "data", "words"),
    [
        (4, 0, b"evil", "do not have the SHA-256"),
        (4, 2, b"il", "in their order"),
        (2, 0, b"evil", "its size"),
        (MOST_BYTES + 1, 0, b"e", "MB"),
    ],
)
def test_a_wrong_piece_is_refused(store: Store, size: int, offset: int, data: bytes, words: str) -> None:
    digest = digest_of(b"good")
    with pytest.raises(QuadvisError, match=words):
        store.put(digest, size, offset, data)
    assert store.missing([digest]) == [digest]
    assert store.put(digest, 4, 0, b"good") == 4


def test_files_that_never_end_take_no_room_for_ever(store: Store) -> None:
    for number in range(3 * PARTLY):
        data = str(number).encode()
        store.put(digest_of(data), 100, 0, data)
    assert len(list((store.folder / "files").iterdir())) == PARTLY
    assert list((Store(store.folder).folder / "files").iterdir()) == []


@pytest.mark.parametrize("name", ["../../etc/passwd", "ab", "A" * 64, "", "z" * 64])
def test_what_is_no_digest_is_no_path(store: Store, name: str) -> None:
    with pytest.raises(QuadvisError, match="SHA-256"):
        store.put(name, 1, 0, b"x")


@given(st.text(max_size=30))
def test_no_path_leaves_the_folder(text: str) -> None:
    try:
        path = inner_path(text)
    except QuadvisError:
        return
    assert not path.is_absolute()
    assert ".." not in path.parts
    assert path.parts


@pytest.mark.parametrize(
    "path", ["../x", "/etc/passwd", "a/../../x", "", ".", "a\\..\\x", "a\0b", "a//b", "./a"]
)
def test_a_bundle_with_such_a_path_is_refused(path: str) -> None:
    bundle, _ = pack(quadvis.load(HOVER))
    plain = bundle.plain() | {"files": {path: "0" * 64}}
    with pytest.raises(QuadvisError, match="leaves the folder"):
        ApplicationBundle.read(plain)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": FORMAT + 1}, "format"),
        ({"name": "../x"}, "no name"),
        ({"text": 3}, "'text' must be a text"),
        ({"files": ["x"]}, "SHA-256 by name"),
        ({"sources": {"a": "b"}}, "SHA-256 by name"),
        ({"text": "x" * 2_000_001}, "characters"),
    ],
)
def test_a_wrong_bundle_is_refused(change: dict[str, object], words: str) -> None:
    plain = pack(quadvis.load(HOVER))[0].plain() | change
    with pytest.raises(QuadvisError, match=words):
        ApplicationBundle.read(plain)
    with pytest.raises(QuadvisError, match=words):
        ApplicationBundle.parse(json.dumps(plain).encode())


@given(st.binary(max_size=200))
def test_anything_else_is_no_bundle(data: bytes) -> None:
    with pytest.raises(QuadvisError):
        ApplicationBundle.parse(data)


def test_a_bundle_is_the_same_as_data() -> None:
    bundle, _ = pack(quadvis.load(HOVER))
    assert ApplicationBundle.parse(bundle.data) == bundle


def test_a_block_with_another_source_is_refused(store: Store) -> None:
    bundle = sent(store, HOVER)
    other = ApplicationBundle.read(
        bundle.plain() | {"sources": {**bundle.sources, "vision.pose_n_points": "0" * 64}}
    )
    with pytest.raises(QuadvisError, match=r"'vision.pose_n_points' is not the same on host and target"):
        admit(other, store.place(other))


def test_a_diagram_that_names_a_file_outside_is_refused(store: Store, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_bytes((ROOT / "diagrams/calib/camera.yaml").read_bytes())
    bundle = sent(store, HOVER)
    text = bundle.text.replace("calibration: calib/camera.yaml", f"calibration: {secret}")
    other = ApplicationBundle.read(bundle.plain() | {"text": text})
    with pytest.raises(QuadvisError, match="outside the application's folder"):
        admit(other, store.place(other))


def test_a_file_that_is_not_named_lies_nowhere(store: Store) -> None:
    bundle = sent(store, ROOT / "diagrams" / "motor.yaml")  # its transfer functions could have one
    assert admit(store.bundle("motor"), store.place(bundle)).hash == bundle.hash


def test_another_text_than_the_hash_says_is_refused(store: Store) -> None:
    bundle = sent(store, HOVER)
    other = ApplicationBundle.read(bundle.plain() | {"text": bundle.text.replace("seed: 2", "seed: 3")})
    with pytest.raises(QuadvisError, match="reads otherwise"):
        admit(other, store.place(other))


def test_an_unknown_application_is_named(store: Store) -> None:
    sent(store, HOVER)
    with pytest.raises(
        QuadvisError, match="there is no application 'hovr' on the target; did you mean 'hover'"
    ):
        store.bundle("hovr")


def test_own_blocks_are_refused(tmp_path: Path, store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "blocks").mkdir()
    (tmp_path / "blocks" / "twice.py").write_text(
        "from quadvis.block import Block, In, Out\n\n\nclass Twice(Block):\n"
        '    """Twice."""\n\n    u = In()\n    y = Out()\n\n    def output(self, u):\n        return 2 * u\n'
    )
    diagram = tmp_path / "own.yaml"
    diagram.write_text(
        "quadvis: 1\nname: own\nrates: {fast: 10 Hz}\nstop_time: 1 s\nblocks:\n"
        "  a: {block: sources.sine, rate: fast, with: {amplitude: 1, frequency: 1 Hz}}\n"
        "  b: {block: twice, rate: fast, in: {u: a.y}}\n"
    )
    loaded = quadvis.load(diagram)
    with pytest.raises(QuadvisError, match="block 'b' is of the code beside the diagram, which no target"):
        pack(loaded)
    monkeypatch.setattr("quadvis.host.packing._check_code", lambda _: None)  # another host may send it
    bundle, _ = pack(loaded)
    store.add(bundle)
    with pytest.raises(QuadvisError, match="there is no block"):
        admit(bundle, store.place(bundle))


def test_logs_have_numbers_and_the_oldest_go(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadvis.target.store.LOGS", 3)
    for _ in range(5):
        store.next_log("hover").touch()
    assert [path.stem for path in store.logs("hover")] == ["hover-3", "hover-4", "hover-5"]
    with pytest.raises(QuadvisError, match="no log 'hover-9'; did you mean"):
        store.known_log("hover-9")
