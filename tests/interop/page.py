"""The page of `export --format web` in Chromium: as a folder behind a server and as one file from the disk; beside
`nephroid render` of the same camera; moment by moment; by keys, mouse and touch; on a phone; without WebGPU.

check(nephroid, browser, scene, maps, folder, run, faults): maps is a bake of the scene, or a sequence.
"""

import base64
import json
import subprocess
import tempfile
import threading
import time
from contextlib import closing, contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.request import urlopen

import cv2
import flip_evaluator
import numpy
import websocket

PATIENCE_S = 3600
# Software draws them.
SIZE = (480, 270)
PICTURES = 4
PHONE = (390, 844)
# Mean FLIP beside `nephroid render` [1].
FLIP = 0.03
# The gallery's folder [bytes].
GALLERY = 12e6
# The flags by which Chromium without a graphics card gives a canvas to WebGPU.
WEBGPU = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--use-vulkan=swiftshader",
          "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-gpu-watchdog"]
# Without a graphics card, pictures of the window show no WebGPU: a canvas is read in the task that draws it.
READING = """{
  const { getCurrentTexture } = GPUCanvasContext.prototype, { submit } = GPUQueue.prototype;
  let isDrawn = false;
  GPUCanvasContext.prototype.getCurrentTexture = function () { isDrawn = true; return getCurrentTexture.call(this); };
  GPUQueue.prototype.submit = function (commands) {
    submit.call(this, commands);
    if (isDrawn) globalThis.drawn = document.getElementById("picture").toDataURL();
    isDrawn = false;
  };
}"""


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


class Browser:
    """One tab, driven by the DevTools protocol."""

    def __init__(self, program, flags=WEBGPU):
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--remote-debugging-port=0", "--remote-allow-origins=*",
             "--no-first-run", "--hide-scrollbars", f"--user-data-dir={self.profile.name}", *flags, "about:blank"],
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
        if flags:
            self.call("Page.addScriptToEvaluateOnNewDocument", source=f"if (globalThis.GPUQueue) {READING}")

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
        """Waits for the first view, or the still picture; the addresses asked for."""
        self.events.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=is_phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=is_phone)
        self.call("Page.navigate", url=url)
        self.wait()
        return [event["params"]["request"]["url"] for event in self.events if event["method"] == "Network.requestWillBeSent"]

    def wait(self):
        """Until the view is the mean of enough pictures."""
        end = time.time() + PATIENCE_S
        while self.value(f"!(globalThis.nephroid?.drawn >= {PICTURES} || globalThis.nephroid?.state === 'still')"):
            if time.time() > end:
                raise RuntimeError(f"the page has no picture: {self.value('globalThis.nephroid?.error')}")
            time.sleep(0.2)

    def picture(self):
        """What WebGPU drew last."""
        return decoded(self.value("drawn").split(",")[1])

    def window(self):
        """All that the browser shows, but for what WebGPU draws."""
        return decoded(self.call("Page.captureScreenshot", format="png")["data"])

    def close(self):
        self.socket.close()
        self.process.terminate()
        self.process.wait()


def decoded(png):
    bytes = numpy.frombuffer(base64.b64decode(png), numpy.uint8)
    return cv2.imdecode(bytes, cv2.IMREAD_COLOR)[:, :, ::-1].astype("float32") / 255


def flip(wanted, found):
    """Mean over the picture."""
    return float(flip_evaluator.evaluate(wanted, found, "LDR", applyMagma=False)[0].mean())


def steer(browser, faults):
    """Every way to move changes the camera."""
    place = "JSON.stringify([nephroid.navigation.position, nephroid.navigation.yaw, nephroid.navigation.mode])"

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
        return ("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": 100, "button": "left", "buttons": 1} | more)

    def touch(kind, *places):
        return ("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in places]})

    moves("W", key("KeyW", "keyDown"), key("KeyW", "keyUp"))
    moves("the mouse", mouse("mousePressed", 100, clickCount=1), mouse("mouseMoved", 200), mouse("mouseReleased", 200, clickCount=1))
    moves("V", key("KeyV", "keyDown"), key("KeyV", "keyUp"))
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    moves("a finger", touch("touchStart", (200, 100)), touch("touchMove", (260, 100)), touch("touchEnd"))
    moves("two fingers", touch("touchStart", (100, 100), (200, 100)), touch("touchMove", (50, 100), (250, 100)), touch("touchEnd"))
    browser.call("Emulation.setTouchEmulationEnabled", enabled=False)


def play(browser, faults):
    """The button plays moments, and pauses them."""
    click = "document.querySelector('#motion button').click()"
    seen, end = set(), time.time() + PATIENCE_S / 60
    browser.value(click)
    while len(seen) < 3 and time.time() < end:
        seen.add(browser.value("nephroid.motion.shown"))
        time.sleep(0.1)
    browser.value(click)
    if len(seen) < 3 or browser.value("nephroid.motion.isPlaying"):
        faults.append(f"the page plays moments {seen}")


@contextmanager
def served(folder):
    """Address of a folder behind a server."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def check_still(browser, url, faults):
    """Without WebGPU, the page shows its picture and says why."""
    with closing(Browser(browser, [])) as tab:
        tab.open(url, SIZE)
        told, is_there = tab.value("document.getElementById('told').innerText"), tab.value("still.naturalWidth > 0")
        spread = float(tab.window().std())
    print(f"without WebGPU: {told}")
    if "WebGPU" not in told or not is_there or spread < 0.02:
        faults.append("the page without WebGPU")


def check(nephroid, browser, scene, maps, folder, run, faults):
    folder.mkdir(exist_ok=True)
    site, file, picture = folder / "site", folder / "site.html", folder / "render.png"
    for path, options in [(site, []), (file, ["--single-file"])]:
        run(nephroid, "export", maps, "--format", "web", "-o", path, *options)
    sequence = json.loads((maps / "manifest.json").read_text()).get("sequence")
    size = ["--maps", maps, "--size", "{}x{}".format(*SIZE)]
    page = (site / "index.html").read_text().split('id="about">')[1]
    stops = json.loads(page.split("</script>")[0])["cameras"][0]["exposure_stops"]
    if sequence:
        times = ["--frames", len(sequence["frames"]), "--fps", sequence["fps"]]
        run(nephroid, "render", scene, *size, *times, "-o", folder / "frames", "--exposure", stops)
        wanted = [cv2.imread(str(frame)) for frame in sorted((folder / "frames").glob("*.png"))]
    else:
        run(nephroid, "render", scene, *size, "-o", picture, "--exposure", stops)
        wanted = [cv2.imread(str(picture))]
    wanted = [picture[:, :, ::-1].astype("float32") / 255 for picture in wanted]
    # A browser that outlives a fault goes on drawing.
    with served(site) as own, closing(Browser(browser)) as tab:
        for what, url, allowed in [("folder", own, own), ("one file", file.as_uri(), file.as_uri())]:
            asked = tab.open(url, SIZE)
            away = [url for url in asked if not url.startswith((allowed, "data:", "blob:"))]
            print(f"{scene}, web as {what}: first picture after {tab.value('nephroid.firstPicture_ms'):.0f} ms")
            # One file has the same moments.
            for moment, picture in enumerate(wanted if what == "folder" else wanted[:1]):
                if moment:
                    tab.value(f"nephroid.motion.seek({moment})")
                    tab.wait()
                error = flip(picture, tab.picture())
                print(f"{scene}, web as {what}, moment {moment}: mean FLIP {error:.4f} beside render; "
                      f"{len(asked)} requests, {len(away)} elsewhere")
                if not error <= FLIP:
                    faults.append(f"{scene} as {what}: FLIP")
            if away:
                faults.append(f"{scene} as {what}: {away}")
            lit = tab.picture()
            tab.value("document.querySelector('[name=colours]').click()")
            tab.wait()
            if not flip(lit, tab.picture()) > FLIP:
                faults.append(f"{scene} as {what}: false colours")
        if sequence:
            play(tab, faults)
        steer(tab, faults)
        tab.open(own, PHONE, is_phone=True)
        wide = tab.value("document.scrollingElement.scrollWidth - innerWidth")
        if wide > 0:
            faults.append(f"{scene}: wider than a phone by {wide} pixels")
        check_still(browser, own, faults)
    code = sum(entry.stat().st_size for entry in site.iterdir() if entry.suffix in {".js", ".html"})
    whole = sum(entry.stat().st_size for entry in site.iterdir())
    print(f"{scene}: folder {whole / 1e6:.2f} MB, {code / 1e3:.0f} kB of it code; one file {file.stat().st_size / 1e6:.2f} MB")
    if scene == "builtin:gallery" and whole > GALLERY:
        faults.append(f"{scene}: the folder is {whole} bytes")
