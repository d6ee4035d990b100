"""Keys and lists of keys on disk, and the commands that change them."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.wire.hosts import FILE, AuthorizedHosts, allow, read_network, revoke
from quadvis.wire.keys import fingerprint, made_pair, new_key, own_key, own_names, read_public
from quadvis.wire.known import KnownTargets
from quadvis.wire.refusals import WrongTargetError

KEY = "ab" * 32
OTHER = "cd" * 32


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def test_a_key_is_kept_in_a_closed_file_and_read_back(folder: Path) -> None:
    pair, path = new_key("anna")
    assert own_key("anna") == pair == own_key() and own_names() == ["anna"]
    assert stat.S_IMODE(path.stat().st_mode) == 0o600 and stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert pair.private.hex() in path.read_text() and repr(pair).count("private") == 0
    with pytest.raises(QuadvisError, match="there is a file"):
        new_key("anna")
    assert own_key("anna") == pair


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644])
def test_a_private_file_that_others_can_open_is_refused(mode: int, folder: Path) -> None:
    _, path = new_key("anna")
    path.chmod(mode)
    with pytest.raises(QuadvisError, match=r"is open to other users; run 'chmod 600"):
        own_key("anna")


def test_a_folder_that_others_can_open_is_refused(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o755)
    with pytest.raises(QuadvisError, match=r"is open to other users; run 'chmod 700"):
        allow("anna", KEY, 3)
    (folder / "keys").mkdir()
    (folder / "keys").chmod(0o750)
    with pytest.raises(QuadvisError, match="is open to other users"):
        new_key("anna")


@pytest.mark.parametrize("change", ["cut", "swapped", "empty", "binary"])
def test_a_damaged_key_file_is_refused_and_not_quoted(change: str, folder: Path) -> None:
    pair, path = new_key("anna")
    other = made_pair("x")
    text = path.read_text()
    new = {
        "cut": text[:-20],
        "swapped": text.replace(pair.public.hex(), other.public.hex()),
        "empty": "",
        "binary": "\xff\xfe\x00",
    }[change]
    path.write_bytes(new.encode("latin-1"))
    with pytest.raises(QuadvisError) as caught:
        own_key("anna")
    assert pair.private.hex()[:16] not in str(caught.value)


@pytest.mark.parametrize("name", ["", "../a", "a/b", ".a", "a b", "ä", "a" * 65, "a\n"])
def test_a_name_that_could_leave_the_folder_is_refused(name: str, folder: Path) -> None:
    for use in (lambda: new_key(name), lambda: own_key(name), lambda: allow(name, KEY, 3)):
        with pytest.raises(QuadvisError):
            use()
    assert not list(folder.rglob("*.key"))


@pytest.mark.parametrize("text", ["", "ab", "zz" * 32, KEY + "0", "0x" + KEY])
def test_a_text_that_is_no_key_is_refused(text: str) -> None:
    with pytest.raises(QuadvisError, match="64 hexadecimal digits"):
        read_public(text)


def test_the_fingerprint_differs_with_the_key() -> None:
    assert fingerprint(bytes.fromhex(KEY)) != fingerprint(bytes.fromhex(OTHER))
    assert len(fingerprint(b"x" * 32).replace("-", "")) == 32


def test_hosts_are_let_in_from_their_networks_until_they_are_revoked(folder: Path) -> None:
    allow("anna", KEY, 3, ["192.168.1.0/24", "fd00::/8"])
    hosts = AuthorizedHosts()
    key = bytes.fromhex(KEY)
    for address in ("192.168.1.7", "::ffff:192.168.1.7", "fd00::1%eth0"):
        assert hosts.find(key, address) is not None
    for address in ("192.168.2.7", "::1", "", "nonsense"):
        assert hosts.find(key, address) is None
    assert hosts.find(bytes.fromhex(OTHER), "192.168.1.7") is None
    allow("anna", KEY, 1)
    assert hosts.refresh() and not hosts.refresh()
    host = hosts.find(key, "10.0.0.1")
    assert host is not None and host.level == 1
    revoke("anna")
    assert hosts.refresh() and hosts.find(key, "10.0.0.1") is None
    with pytest.raises(QuadvisError, match="no host 'anna' is let in"):
        revoke("anna")


def test_a_key_has_one_name_and_a_level(folder: Path) -> None:
    allow("anna", KEY, 3)
    with pytest.raises(QuadvisError, match="'anna' has this key already"):
        allow("bob", KEY, 0)
    for level in (-1, 5):
        with pytest.raises(QuadvisError, match="there is no level"):
            allow("bob", OTHER, level)
    with pytest.raises(QuadvisError, match="is no network"):
        allow("bob", OTHER, 3, ["192.168.1.7/24"])
    assert read_network("::1").num_addresses == 1


WRONG = {
    "no map": ("- anna\n", 0),
    "no YAML": ("anna: {key: [\n", 0),
    "twice": (f"anna: {{key: {KEY}, level: 3}}\nbob: {{key: {KEY}, level: 0}}\n", 0),
    "no level": (f"anna: {{key: {KEY}}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
    "level 5": (f"anna: {{key: {KEY}, level: 5}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
    "no key": (f"anna: {{key: abc, level: 0}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
    "no network": (f"anna: {{key: {KEY}, level: 0, networks: [x]}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
    "networks empty": (f"anna: {{key: {KEY}, level: 0, networks: []}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
    "odd name": (f"../anna: {{key: {KEY}, level: 0}}\nbob: {{key: {OTHER}, level: 0}}\n", 1),
}


@pytest.mark.parametrize("name", WRONG)
def test_an_entry_with_a_fault_lets_nobody_in(name: str, folder: Path) -> None:
    text, others = WRONG[name]
    allow("anna", KEY, 0)
    hosts = AuthorizedHosts()
    assert len(list(hosts)) == 1
    (folder / FILE).write_text(text)
    hosts.refresh()
    assert len(list(hosts)) == others and hosts.find(bytes.fromhex(KEY), "127.0.0.1") is None
    assert hosts.faults and str(folder / FILE) in str(hosts.faults[0])
    with pytest.raises(QuadvisError):  # nor is the file written over
        allow("eve", "ef" * 32, 0)
    assert (folder / FILE).read_text() == text


def test_a_list_that_others_can_change_lets_nobody_in(folder: Path) -> None:
    allow("anna", KEY, 0)
    (folder / FILE).chmod(0o666)
    hosts = AuthorizedHosts()
    assert not list(hosts) and "other users can change this file" in str(hosts.faults[0])


def test_a_list_that_is_removed_while_it_is_read_lets_nobody_in_until_it_is_back(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    allow("anna", KEY, 3)
    hosts = AuthorizedHosts()
    allow("bob", OTHER, 3)

    def removed(path: Path, faults: object) -> None:
        raise FileNotFoundError(path)

    with monkeypatch.context() as patched:
        patched.setattr("quadvis.wire.hosts.read_hosts", removed)
        assert hosts.refresh() and not list(hosts)
    assert hosts.refresh() and [host.name for host in hosts] == ["anna", "bob"]


def test_a_target_is_pinned_and_another_key_is_refused_with_both_fingerprints(folder: Path) -> None:
    known = KnownTargets()
    key, other = bytes.fromhex(KEY), bytes.fromhex(OTHER)
    known.pin("lab1", "10.0.0.1:22222", key)
    known.pin("lab1", "10.0.0.1:22222", key)
    places = (("lab1", "10.0.0.1:22222"), ("lab1", "10.0.0.2:22222"), ("lab2", "10.0.0.1:22222"))
    for name, address in places:
        with pytest.raises(WrongTargetError) as caught:
            known.pin(name, address, other)
        assert fingerprint(key) in str(caught.value) and fingerprint(other) in str(caught.value)
        assert "quadvis keys forget lab1" in str(caught.value)
    assert known.find("10.0.0.1:22222") == known.find("lab1") and known.find("lab2") is None
    known.forget("lab1")
    assert known.pin("lab1", "10.0.0.1:22222", other).public == other


def test_the_commands_make_show_allow_and_revoke(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def done(*words: str) -> str:
        assert main(["keys", *words]) == 0
        return capsys.readouterr().out

    public = done("new", "anna").partition("public key ")[2][:64]
    assert public == own_key("anna").public.hex()
    allowed = done("allow", "bob", KEY, "--level", "3", "--from", "10.0.0.0/8", "--from", "::1")
    assert "may look, not change (level 3) from 10.0.0.0/8, ::1/128" in allowed
    KnownTargets().pin("lab1", "10.0.0.1:22222", bytes.fromhex(OTHER))
    shown = done("show")
    assert all(text in shown for text in (public, "bob: may look", "lab1: 10.0.0.1:22222"))
    assert own_key("anna").private.hex() not in shown
    assert "let in no more" in done("revoke", "bob") and "forgotten" in done("forget", "lab1")
    assert "bob" not in done("show")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["keys"], "ACTION is missing"), (["keys", "neu"], "cannot be 'neu'"),
        (["keys", "new"], "NAME is missing"), (["keys", "allow", "bob"], "PUBLIC is missing"),
        (["keys", "allow", "bob", KEY], "--level is missing"),
        (["keys", "allow", "bob", KEY, "--level", "7"], "there is no level 7"),
        (["keys", "allow", "bob", "x", "--level", "3"], "is no public key"),
        (["keys", "new", "bob", KEY], "takes no public key"),
        (["keys", "new", "bob", "--level", "0"], "takes no level"),
        (["keys", "revoke", "bob"], "no host 'bob'"), (["keys", "forget", "lab"], "no target 'lab'"),
        (["keys", "show", "bob"], "there is no key 'bob'"), (["wire", "x"], "is one too many"),
    ],
    ids=str,
)  # fmt: skip
def test_a_wrong_command_is_one_sentence(
    words: list[str], sentence: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    error = capsys.readouterr().err
    assert sentence in error and error.count("\n") == 1
