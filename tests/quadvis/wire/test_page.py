"""The page of the wire has every verb; a client in C that was written after it talks to a real server."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.wire.argument import REQUIRED
from quadvis.wire.refusals import KINDS
from quadvis.wire.server import Server
from quadvis.wire.verbs import TOPICS, VERBS
from tests.quadvis.wire.rig import Echo, Rig

SOURCE = Path(__file__).with_name("client.c")
HEADERS = [Path(folder) / "zmq.h" for folder in ("/usr/include", "/usr/local/include")]


def test_the_page_has_every_verb_argument_topic_and_kind(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wire"]) == 0
    text = capsys.readouterr().out
    parts = text.split("\n### ")
    assert [part.partition("`\n")[0].strip("`") for part in parts[1:]] == list(VERBS)
    for part, verb in zip(parts[1:], VERBS.values(), strict=True):
        assert f"(level {verb.level}" in part and verb.reply in part
        assert ("needs the lease" in part) == verb.leased and ("audited" in part) == verb.changes
        for each in verb.arguments:
            assert f"- `{each.name}`: {each.type.words}" in part
            assert (f"{each.doc}; default" in part) == (each.default is not REQUIRED)
    assert all(topic.doc in text for topic in TOPICS) and all(f"*{kind}*" in text for kind in KINDS)


def test_what_needs_no_wire_does_not_import_it() -> None:
    script = (
        "import sys, quadvis, quadvis.api, quadvis.cli.options as o; from quadvis.cli import main\n"
        "main(['check', 'diagrams/hover.yaml'])\n"
        "print(sorted({'zmq', 'msgpack', 'quadvis.wire'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc")
    if not any(path.is_file() for path in HEADERS):
        pytest.skip("there is no zmq.h; Debian has it in libzmq3-dev")
    made = tmp_path_factory.mktemp("client") / "client"
    subprocess.run([compiler, "-Wall", "-Wextra", "-Werror", "-o", made, SOURCE, "-lzmq"], check=True)
    return made


GOOD = ["status: ok", "the application is stopped", "lease: ok", "setparam: ok", "at a tick"]


def test_a_client_in_c_tunes_a_parameter_at_a_path(program: Path, tmp_path: Path) -> None:
    echo = Echo()
    with Server("lab1", echo) as server:
        path = server.listen_here(str(tmp_path / "run" / "lab1"))
        server.start()
        done = subprocess.run([program, f"ipc://{path}"], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.splitlines()) == (0, GOOD)
    assert echo.values == {"roll.gain": 2.5}


@pytest.mark.parametrize("level", [0, 3])
def test_a_client_in_c_with_a_key_may_what_its_level_may(level: int, program: Path, rig: Rig) -> None:
    pair = rig.key("anna", level)
    keys = [each.hex() for each in (rig.pair.public, pair.public, pair.private)]
    words = [program, f"tcp://127.0.0.1:{rig.port}", *keys]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    if level == 0:
        assert (done.returncode, done.stdout.splitlines()) == (0, GOOD)
        assert rig.echo.values == {"roll.gain": 2.5}
    else:
        refused = ["status: ok", "the application is stopped", "lease: refused", "setparam: refused"]
        assert (done.returncode, done.stdout.splitlines()) == (1, refused)
        assert rig.echo.values == {}
