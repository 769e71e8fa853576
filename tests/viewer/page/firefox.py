#!/usr/bin/env python3
"""The page in Firefox: it draws, counts steps, and a key moves the catheter. 77, with the reason: something it needs is not here.

    firefox.py PROGRAM BUILD_FOLDER SOURCE_FOLDER

Firefox is driven over Marionette, its own remote protocol: a TCP connection, each message its length, a colon, and JSON.
"""

import base64
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

PATIENCE = 120.0  # s: ends what hangs, decides nothing


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


class Browser:
    def __init__(self, firefox, display, folder):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        pathlib.Path(folder, "user.js").write_text("".join(f'user_pref("{key}", {json.dumps(value)});\n' for key, value in {
            "marionette.port": port, "webgl.force-enabled": True, "browser.shell.checkDefaultBrowser": False,
            "datareporting.policy.dataSubmissionEnabled": False, "app.update.enabled": False}.items()))
        self.process = subprocess.Popen([firefox, "--no-remote", "--marionette", "--profile", folder], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                        env={**os.environ, "HOME": folder, "DISPLAY": display, "LIBGL_ALWAYS_SOFTWARE": "1"})
        self.buffer, self.last, until = b"", 0, time.monotonic() + PATIENCE
        while True:
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
                break
            except OSError:
                if time.monotonic() > until or self.process.poll() is not None:
                    skip("Firefox does not start here")
                time.sleep(0.2)
        self.read()
        self.call("WebDriver:NewSession")

    def read(self):
        while b":" not in self.buffer:
            self.take()
        size, _, self.buffer = self.buffer.partition(b":")
        while len(self.buffer) < int(size):
            self.take()
        message, self.buffer = self.buffer[:int(size)], self.buffer[int(size):]
        return json.loads(message)

    def take(self):
        some = self.socket.recv(1 << 20)
        if not some:
            sys.exit("Firefox ended the connection")
        self.buffer += some

    def call(self, name, **parameters):
        self.last += 1
        message = json.dumps([0, self.last, name, parameters]).encode()
        self.socket.sendall(b"%d:%s" % (len(message), message))
        answer = self.read()
        if answer[2]:
            sys.exit(f"{name}: {answer[2]}")
        return answer[3]

    def run(self, code):
        return self.call("WebDriver:ExecuteScript", script=code, args=[])["value"]

    def wait(self, code, what):
        until = time.monotonic() + PATIENCE
        while not (value := self.run(code)):
            if time.monotonic() > until:
                sys.exit(f"{what}: not within {PATIENCE:.0f} s; the page says: {self.run('return document.body.innerText')[:600]}")
            time.sleep(0.2)
        return value


def main():
    program, build, source = sys.argv[1:4]
    firefox, server = shutil.which("firefox-esr") or shutil.which("firefox"), shutil.which("Xvfb")
    if not firefox:
        skip("Firefox is not installed (apt-get install firefox-esr)")
    if not server:
        skip("Firefox draws nothing without a screen, and Xvfb is not installed (apt-get install xvfb libgl1)")
    if not pathlib.Path(build, "page/index.html").exists():
        skip(f"the page was not built (cmake --build {build} --target viewer_page)")
    number, ready = os.pipe()
    screen = subprocess.Popen([server, "-displayfd", str(ready), "-screen", "0", "1280x800x24", "+extension", "GLX"], pass_fds=[ready],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(ready)
    display = ":" + os.read(number, 16).decode().strip()
    view = subprocess.Popen([program, "view", f"{source}/assets/scenes/u_bend.json", "--quiet"], stdout=subprocess.PIPE, text=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = None
        try:
            url = view.stdout.readline().strip()
            browser = Browser(firefox, display, folder)
            if not browser.run("return !!document.createElement('canvas').getContext('webgl2')"):
                skip("Firefox has no WebGL 2 on this machine")
            browser.call("WebDriver:Navigate", url=url)
            browser.run("window.complaints = []; addEventListener('error', (e) => complaints.push(e.message)); "
                        "addEventListener('unhandledrejection', (e) => complaints.push(String(e.reason)))")
            browser.wait("return /step \\d+/.test(document.body.innerText)", "steps are counted")
            browser.wait("return /pictures a second/.test(document.body.innerText)", "the view is drawn")
            inserted = "return parseFloat(document.getElementById('insertion').textContent)"
            browser.run("document.activeElement?.blur(); dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', code: 'Escape', bubbles: true}))")
            before = browser.run(inserted)
            press = "document.getElementById('view').dispatchEvent(new KeyboardEvent('key{}', {{key: 'w', code: 'KeyW', bubbles: true}}))"
            browser.run("document.getElementById('view').focus(); " + press.format("down"))
            browser.wait(f"return (() => {{ {inserted} }})() > {before + 2.0}", "W pushes the catheter")
            browser.run(press.format("up"))
            complaints = browser.run("return complaints")
            assert not complaints, complaints
            picture = base64.b64decode(browser.call("WebDriver:TakeScreenshot", full=False)["value"])
            assert len(picture) > 20_000, "an empty page is a small picture"
            print(f"Firefox: W pushed the catheter from {before} to {browser.run(inserted)} mm; nothing to complain about")
        finally:
            for process in (browser and browser.process, view, screen):
                if process:
                    process.kill()
                    process.wait()


main()
