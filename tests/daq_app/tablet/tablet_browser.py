"""A real browser without a screen, driven over its own debugging protocol as a person drives a tablet."""

import base64
import json
import re
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

from browser import CHROMIUM, FLAGS
from websockets.sync.client import connect

PATIENCE = 30.0  # [s]


class Browser:
    """One tab; `wait` lets the program go on while the page is waited for."""

    def __init__(self, folder: Path, wait=lambda: time.sleep(0.01), size=(1024, 700)):
        options = ("--remote-debugging-port=0", f"--user-data-dir={folder}", "--window-size={},{}".format(*size))
        self.process = subprocess.Popen(
            [CHROMIUM, *FLAGS, *options, "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.wait = wait
        line = next(line for line in self.process.stderr if "DevTools listening" in line)
        browser = re.search(r"ws://\S+", line)[0]
        self.number = 0
        with connect(browser, max_size=None) as talk:
            target = self._call(talk, "Target.getTargets")["targetInfos"]
        page = next(entry["targetId"] for entry in target if entry["type"] == "page")
        at = f"{browser.partition('/devtools')[0]}/devtools/page/{page}"
        self.open = ExitStack()
        self.page = self.open.enter_context(connect(at, max_size=None))

    def _call(self, talk, method, **params):
        self.number += 1
        talk.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while True:
            try:
                answer = json.loads(talk.recv(0.0))
            except TimeoutError:
                self.wait()
                continue
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def call(self, method, **params):
        return self._call(self.page, method, **params)

    def value(self, script):
        """Return what a script gives."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def until(self, script, what=None):
        """Wait until a script gives something true, and return it."""
        end = time.monotonic() + PATIENCE
        while not (value := self.value(script)):
            assert time.monotonic() < end, f"{what or script} did not come: {self.value('document.body.innerText')}"
            self.wait()
        return value

    def reload(self, script, what=None):
        """Load the page anew, and wait until a script gives something true on it."""
        self.value("window.old = true")
        self.call("Page.reload")
        self.until(f"document.readyState == 'complete' && !window.old && {script}", what)

    def is_visible(self, name):
        return self.value(f"!document.getElementById('{name}').hidden")

    def text(self):
        return self.value("document.body.innerText")

    def middle(self, name, along=0.5):
        box = self.value(
            f"(b => [b.x, b.y, b.width, b.height])(document.getElementById('{name}').getBoundingClientRect())"
        )
        return box[0] + along * box[2], box[1] + box[3] / 2

    def touch(self, name, *along):
        """Touch something with a finger, go along it, and leave it."""
        for number, part in enumerate(along):
            x, y = self.middle(name, part)
            kind = "touchStart" if number == 0 else "touchMove"
            self.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y}])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def click(self, name):
        x, y = self.middle(name)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def type(self, text):
        self.call("Input.insertText", text=text)

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def picture(self, path):
        Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        self.open.close()
        self.process.kill()
        self.process.wait()
        self.process.stderr.close()
