"""The page of `export --format web` in Chromium: as a folder behind a server and as one file from the disk; beside
`nephroid render` of the same camera; by keys, mouse and touch; on a phone.

check(nephroid, browser, maps, folder, run, faults): maps is a bake with all layers.
"""

import base64
import json
import subprocess
import tempfile
import threading
import time
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.request import urlopen

import cv2
import flip_evaluator
import websocket

PATIENCE_S = 300
SIZE = (960, 540)
PHONE = (390, 844)
# Mean FLIP of matt surfaces with maps beside `nephroid render` [1]: what is seen in mirrors, glass and coat is
# approximated in the page.
FLIP = 0.03
# In false colours, coated surfaces are as grey as mirrors and glass.
MATT = """nephroid.stage.meshes.forEach(({ material }) => {
  if (material.uniforms.coat.value > 0) { delete material.defines.LIT; material.needsUpdate = true; }
})"""
# What has no map, in false colours: 1 % in linear light.
NO_MAP = 25
# Scripts of the page with three.js, gzipped [bytes].
CODE = 1 << 20
# The gallery's folder [bytes].
GALLERY = 12e6


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


class Browser:
    """One tab, driven by the DevTools protocol."""

    def __init__(self, program):
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader",
             "--remote-debugging-port=0", "--remote-allow-origins=*", "--no-first-run", "--hide-scrollbars",
             f"--user-data-dir={self.profile.name}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        told = Path(self.profile.name) / "DevToolsActivePort"
        end = time.time() + PATIENCE_S
        while not (told.exists() and told.read_text().strip()):
            if time.time() > end:
                raise RuntimeError("the browser does not start")
            time.sleep(0.1)
        port = told.read_text().split()[0]
        tabs = json.load(urlopen(f"http://127.0.0.1:{port}/json"))
        tab = next(tab for tab in tabs if tab["type"] == "page")
        self.socket = websocket.create_connection(tab["webSocketDebuggerUrl"], timeout=PATIENCE_S)
        self.number = 0
        self.events = []
        for domain in ["Page", "Network", "Runtime"]:
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self.socket.recv())
            if told.get("id") == self.number:
                if "error" in told:
                    raise RuntimeError(f"{method}: {told['error']}")
                return told["result"]
            self.events.append(told)

    def value(self, code):
        told = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in told:
            raise RuntimeError(f"{code}: {told['exceptionDetails']}")
        return told["result"].get("value")

    def open(self, url, size, is_phone=False):
        """Waits until the page has drawn its last picture; the time of the first [s] and the addresses asked for."""
        self.events.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=is_phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=is_phone)
        self.call("Page.navigate", url=url)
        end = time.time() + PATIENCE_S
        while (state := self.value("globalThis.nephroid?.state")) != "done":
            if state == "failed" or time.time() > end:
                raise RuntimeError(f"{url}: {self.value('globalThis.nephroid?.error')}")
            time.sleep(0.2)
        asked = [event["params"]["request"]["url"] for event in self.events if event["method"] == "Network.requestWillBeSent"]
        return self.value("nephroid.firstPicture_ms") / 1000, asked

    def picture(self, file):
        """Without the panel."""
        self.value("document.querySelectorAll('#panel, #menu, #scale').forEach((one) => { one.style.visibility = 'hidden'; })")
        shot = self.call("Page.captureScreenshot", format="png")["data"]
        file.write_bytes(base64.b64decode(shot))

    def close(self):
        self.socket.close()
        self.process.terminate()
        self.process.wait()


def flip(wanted, found, coloured):
    """Mean FLIP over the picture, and over the matt surfaces with maps alone: false colours leave others grey."""
    wanted, found, coloured = (cv2.imread(str(file))[:, :, ::-1] for file in (wanted, found, coloured))
    pictures = [picture.astype("float32") / 255 for picture in (wanted, found)]
    error = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False)[0].squeeze()
    has_map = (coloured != NO_MAP).any(axis=2)
    return float(error.mean()), float(error[has_map].mean())


def steer(browser, faults):
    """Every way to move changes the camera."""
    place = "JSON.stringify([...nephroid.navigation.position, nephroid.navigation.yaw, nephroid.navigation.mode])"

    def moves(what, *calls):
        before = browser.value(place)
        for method, parameters in calls:
            browser.call(method, **parameters)
            time.sleep(0.3)
        after = browser.value(place)
        if before == after:
            faults.append(f"the page: {what} changes nothing")

    def key(code, kind):
        return ("Input.dispatchKeyEvent", {"type": kind, "code": code, "key": code[-1].lower()})

    def mouse(kind, x, **more):
        return ("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": 300, "button": "left", "buttons": 1} | more)

    def touch(kind, *places):
        return ("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in places]})

    moves("W", key("KeyW", "keyDown"), key("KeyW", "keyUp"))
    moves("the mouse", mouse("mousePressed", 300, clickCount=1), mouse("mouseMoved", 400), mouse("mouseReleased", 400, clickCount=1))
    moves("V", key("KeyV", "keyDown"), key("KeyV", "keyUp"))
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    moves("a finger", touch("touchStart", (200, 300)), touch("touchMove", (260, 300)), touch("touchEnd"))
    moves("two fingers", touch("touchStart", (200, 300), (300, 300)), touch("touchMove", (150, 300), (350, 300)), touch("touchEnd"))
    browser.call("Emulation.setTouchEmulationEnabled", enabled=False)


@contextmanager
def served(folder):
    """Address of a folder behind a server."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def check_motion(nephroid, browser, maps, folder, run, faults):
    """A sequence plays by T, and its slider shows each moment."""
    run(nephroid, "export", maps, "--format", "web", "-o", folder)
    tab = Browser(browser)
    with served(folder) as own:
        tab.open(own, SIZE)
        count = tab.value("nephroid.motion.count")
        tab.call("Input.dispatchKeyEvent", type="keyDown", code="KeyT", key="t")
        end = time.time() + PATIENCE_S
        seen = set()
        while len(seen) < 2 and time.time() < end:
            seen.add(tab.value("nephroid.motion.shown"))
        tab.value("nephroid.motion.toggle()")
        shots = [folder / f"{moment}.png" for moment in (0, count - 1)]
        for moment, shot in zip((0, count - 1), shots):
            tab.value(f"nephroid.motion.seek({moment}).then(() => new Promise(requestAnimationFrame))")
            tab.picture(shot)
    tab.close()
    first, last = (cv2.imread(str(shot)).astype("float32") / 255 for shot in shots)
    changed = float(flip_evaluator.evaluate(first, last, "LDR", applyMagma=False)[0].mean())
    print(f"{maps.name}, web: {count} moments, mean FLIP {changed:.4f} between the first and the last")
    if len(seen) < 2 or not changed > 0:
        faults.append("the page of a sequence stands still")


def check(nephroid, browser, scene, maps, folder, run, faults):
    folder.mkdir(exist_ok=True)
    site, file, picture = folder / "site", folder / "site.html", folder / "render.png"
    for path, options in [(site, []), (file, ["--single-file"])]:
        run(nephroid, "export", maps, "--format", "web", "-o", path, *options)
    told = json.loads(run(nephroid, "render", scene, "--maps", maps, "--size", "{}x{}".format(*SIZE), "-o", picture, "--json"))
    query = f"?exposure={told['exposure_stops']}"
    tab = Browser(browser)
    with served(site) as own:
        for what, url, allowed in [("folder", own, own), ("one file", file.as_uri(), file.as_uri())]:
            seconds, asked = tab.open(url + query, SIZE)
            shot = folder / f"{what.replace(' ', '_')}.png"
            tab.picture(shot)
            away = [url for url in asked if not url.startswith((allowed, "data:", "blob:"))]
            tab.value(MATT)
            tab.value("document.querySelector('[name=colours]').click()")
            time.sleep(3)
            tab.picture(folder / "colours.png")
            whole, maps_alone = flip(picture, shot, folder / "colours.png")
            print(f"{scene}, web as {what}: mean FLIP {whole:.4f} beside render, {maps_alone:.4f} of matt surfaces; "
                  f"first picture after {seconds:.2f} s, {len(asked)} requests, {len(away)} elsewhere")
            if away or maps_alone > FLIP:
                faults.append(f"{scene} as {what}: {away or 'FLIP'}")
        steer(tab, faults)
        tab.open(own, PHONE, is_phone=True)
        tab.picture(folder / "phone.png")
        wide = tab.value("document.scrollingElement.scrollWidth - innerWidth")
        if wide > 0:
            faults.append(f"{scene}: wider than a phone by {wide} pixels")
    tab.close()
    code = [entry for entry in site.rglob("*") if entry.suffix in {".js", ".html"}]
    packed = sum(len(subprocess.run(["gzip", "-9c", entry], capture_output=True, check=True).stdout) for entry in code)
    whole = sum(entry.stat().st_size for entry in site.rglob("*") if entry.is_file())
    print(f"{scene}: folder {whole / 1e6:.2f} MB, code {packed / 1e3:.0f} kB gzipped, one file {file.stat().st_size / 1e6:.2f} MB")
    if packed > CODE:
        faults.append(f"{scene}: the page's code is {packed} bytes")
    if scene == "builtin:gallery" and whole > GALLERY:
        faults.append(f"{scene}: the folder is {whole} bytes")
