import threading
from typing import Any

from quadvis.host.connection import HostConnection


class FakeClient:
    """A client that says what happens between its lease and its release."""

    def __init__(self) -> None:
        self.operates = False
        self.told: list[str] = []
        self.entered, self.go = threading.Event(), threading.Event()

    def request(self, verb: str, deadline: float = 3.0, **arguments: Any) -> Any:
        if verb == "stop":
            self.entered.set()
            assert self.go.wait(10)
        if verb != "hello":
            assert self.operates, f"'{verb}' without the lease"
            self.told.append(verb)
        return {"target": "lab", "level": 0}

    def operate(self) -> None:
        self.operates = True
        self.told.append("lease")

    def release(self) -> None:
        self.operates = False
        self.told.append("release")


def test_the_lease_stays_as_long_as_any_thread_needs_it() -> None:
    client = FakeClient()
    connection = HostConnection(client)  # type: ignore[arg-type]
    slow = threading.Thread(target=connection.operate, args=("stop",))
    slow.start()
    assert client.entered.wait(10)
    connection.operate("start")
    client.go.set()
    slow.join()
    assert client.told == ["lease", "start", "stop", "release"]
    with connection.operator():
        connection.operate("start")
        connection.operate("start")
    assert client.told[4:] == ["lease", "start", "start", "release"]
