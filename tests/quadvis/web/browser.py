"""A browser without a window, steered over its own protocol (CDP) by a WebSocket."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run", "--remote-debugging-port=0",
)  # fmt: skip
WAIT = 60.0  # s for what should come at once: the machine may be busy


class Browser:
    """One tab. ``complaints`` has the errors of its page."""

    def __init__(self, folder: Path) -> None:
        assert CHROMIUM is not None
        self.complaints: list[str] = []
        self.folder = folder
        self._process = subprocess.Popen(
            [CHROMIUM, *OPTIONS, f"--user-data-dir={folder / 'profile'}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            self._connect()
        except BaseException:
            self._process.kill()
            raise

    def _connect(self) -> None:
        port = self.folder / "profile" / "DevToolsActivePort"
        self.until(lambda: port.exists() and len(port.read_text().splitlines()) > 1)
        address = f"http://127.0.0.1:{port.read_text().splitlines()[0]}/json"
        with urllib.request.urlopen(address) as answer:
            tab = next(each for each in json.load(answer) if each["type"] == "page")
        self._stack = ExitStack()
        address = tab["webSocketDebuggerUrl"]
        self._line = self._stack.enter_context(connect(address, max_size=None, compression=None, proxy=None))
        self._number = 0
        for domain in ("Page", "Runtime", "Log", "Performance"):
            self.do(f"{domain}.enable")

    def close(self) -> None:
        self._stack.close()
        self._process.terminate()
        self._process.wait(30)

    def do(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        self._line.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while True:
            message = json.loads(self._line.recv(WAIT))
            if message.get("id") == self._number:
                assert "error" not in message, message
                return dict(message["result"])
            if message.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.complaints.append(json.dumps(message["params"])[:500])

    def run(self, code: str) -> Any:
        """Return the value of a JavaScript expression; promises are waited for."""
        found = self.do("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def page(self, code: str) -> Any:
        """Return the value of an expression about ``page``, what main.js exports."""
        return self.run(f"import('/main.js').then(({{page}}) => {code})")

    def text(self, selector: str) -> str:
        return str(self.run(f"document.querySelector({selector!r})?.innerText ?? ''"))

    def open(self, address: str, width: int = 1440, height: int = 900, mobile: bool = False) -> None:
        self.size(width, height, mobile)
        self.do("Page.navigate", url=address)

    def size(self, width: int, height: int, mobile: bool = False) -> None:
        scale = 2 if mobile else 1
        self.do(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=mobile,
        )

    def click(self, x: float, y: float) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            self.do("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def click_on(self, selector: str) -> None:
        x, y = self.run(
            f"(() => {{ const box = document.querySelector({selector!r}).getBoundingClientRect();"
            " return [box.x + box.width / 2, box.y + box.height / 2]; })()"
        )
        self.click(x, y)

    def type(self, text: str) -> None:
        self.do("Input.insertText", text=text)

    def key(self, key: str, code: str, number: int, text: str = "") -> None:
        for kind in ("keyDown", "keyUp"):
            self.do("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number,
                    **({"text": text} if text and kind == "keyDown" else {}))  # fmt: skip

    def until(self, condition: Any) -> Any:
        """Wait until a condition, a function or a JavaScript expression, holds; return its value."""
        end = time.monotonic() + WAIT
        while True:
            found = (
                condition()
                if callable(condition)
                else self.run(f"(() => {{ try {{ return {condition} }} catch {{}} }})()")
            )
            if found:
                return found
            assert time.monotonic() < end, f"it did not come to be: {condition}"
            time.sleep(0.05)

    def picture(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.do("Page.captureScreenshot", format="png")["data"]))
