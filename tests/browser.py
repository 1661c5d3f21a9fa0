"""A headless Chromium for tests of pages; they are skipped where there is none."""

import json
import os
import shutil
import subprocess
import tempfile
import time

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="needs Chromium to draw a page in: apt-get install chromium"
)
LONGEST = 120  # that is waited for a page [s]


class Browser:
    """A page in it, spoken to over its pipe: messages in JSON that end with a zero byte (Chrome DevTools Protocol)."""

    def __init__(self, address):
        self.folder, self.address = tempfile.TemporaryDirectory(ignore_cleanup_errors=True), address
        (self.ear, mouth), (ear, self.mouth) = os.pipe(), os.pipe()
        flags = "--headless=new --no-sandbox --disable-gpu --enable-unsafe-swiftshader --remote-debugging-pipe"
        line = f"exec {CHROMIUM} {flags} --user-data-dir={self.folder.name} about:blank 3<&{ear} 4>&{mouth}"
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen(["bash", "-c", line], pass_fds=(ear, mouth), stdout=quiet, stderr=quiet)
        os.close(ear)
        os.close(mouth)
        self.count, self.heard, self.told, self.session = 0, b"", [], {}

    def ask(self, method, **params):
        self.count += 1
        message = {"id": self.count, "method": method, "params": params} | self.session
        os.write(self.mouth, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.heard:
                more = os.read(self.ear, 1 << 20)
                assert more, "chromium has ended"
                self.heard += more
            one, _, self.heard = self.heard.partition(b"\0")
            answer = json.loads(one)
            if answer.get("id") == self.count:
                return answer["result"]
            self.told.append(answer)

    def __enter__(self):
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = {"sessionId": self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        for part in ("Runtime", "Log", "Page"):
            self.ask(f"{part}.enable")
        self.ask("Page.navigate", url=self.address)
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(30)
        self.folder.cleanup()

    def wait(self, code):
        """Until this is true."""
        end = time.monotonic() + LONGEST
        while not self.value(code):
            assert time.monotonic() < end, (code, self.faults())
            time.sleep(0.1)

    def value(self, code):
        return self.ask("Runtime.evaluate", expression=code, returnByValue=True)["result"].get("value")

    def faults(self):
        """What its console has said that is an error."""
        errors = [one["params"] for one in self.told if one.get("method") == "Runtime.exceptionThrown"]
        said = [one["params"] for one in self.told if one.get("method") == "Runtime.consoleAPICalled"]
        logs = [one["params"]["entry"] for one in self.told if one.get("method") == "Log.entryAdded"]
        return errors + [one for one in said if one["type"] == "error"] + [x for x in logs if x["level"] == "error"]
