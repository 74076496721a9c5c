"""Mirrors and glass as the page's own shaders trace them by WebGPU, beside pictures of the program."""

import base64
import gzip
import json
import struct
import subprocess
import tempfile
import threading
from functools import partial
from http.server import ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlencode

import cv2
import flip_evaluator
import numpy

from three_pixels import Handler

HERE = Path(__file__).parent
SCENES = ["ring", "ball", "pool", "gallery"]
# Software draws them.
WIDTH, HEIGHT = 480, 270
PICTURES = 4
# Largest mean FLIP [1].
BOUND = 0.05
# Codes of 255 by which a pixel differs that shows something else.
APART = 4
# A scene of many triangles on a processor that does other things.
PATIENCE_S = 3600
# The flags by which Chromium without a graphics card gives a canvas to WebGPU.
FLAGS = ["--headless=new", "--no-sandbox", "--no-first-run", "--enable-unsafe-webgpu", "--enable-features=Vulkan",
         "--use-vulkan=swiftshader", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
         "--disable-gpu-watchdog"]


def camera(file):
    """The first camera of a packed .glb as three.js would have it."""
    data = gzip.decompress(file.read_bytes())
    document = json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])
    node = next(node for node in document["nodes"] if "camera" in node)
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    columns = [[1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0],
               [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0],
               [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0],
               [*node.get("translation", [0, 0, 0]), 1]]
    lens = document["cameras"][node["camera"]]["perspective"]
    return {"matrixWorld": {"elements": sum(columns, [])}, "fov": float(numpy.degrees(lens["yfov"])), "near": lens["znear"]}


def drawn(browser, site, asked):
    """What the browser makes of a view."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, roots={"page": HERE, "files": site}))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    Handler.done.clear()
    url = f"http://127.0.0.1:{server.server_port}/page/chains.html?{urlencode({'asked': json.dumps(asked)})}"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen([browser, *FLAGS, f"--user-data-dir={profile}", url],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        came = Handler.done.wait(PATIENCE_S)
        process.terminate()
        process.wait()
    server.shutdown()
    if not came or "error" in Handler.result:
        raise RuntimeError(f"WebGPU: {Handler.result['error'] if came else 'no picture'}")
    pictures = [base64.b64decode(url.split(",")[1]) for url in Handler.result["pictures"]]
    return [decoded(numpy.frombuffer(png, numpy.uint8)) for png in pictures], Handler.result["frames_ms"]


def decoded(png):
    return cv2.imdecode(png, cv2.IMREAD_COLOR)[:, :, ::-1].astype(numpy.float32) / 255


def check(name, nephroid, browser, folder, run, faults):
    """A built-in scene: FLIP against the program's picture; and of the ball, how much of it shows a caustic behind it."""
    maps, site = folder / f"{name}_walk", folder / f"{name}_site"
    run(nephroid, "bake", f"builtin:{name}", "-o", maps, "--preset", "preview", "--layers", "caustic,direct", "--quiet")
    run(nephroid, "export", maps, "--format", "web", "-o", site)
    size = ["--maps", maps, "--size", f"{WIDTH}x{HEIGHT}", "--backend", "gpu"]
    file = folder / f"{name}.png"
    told = json.loads(run(nephroid, "render", f"builtin:{name}", *size, "-o", file, "--json"))
    view = {"camera": camera(site / "scene.glb.gz"), "width": WIDTH, "height": HEIGHT,
            "exposureStops": told["exposure_stops"], "toneMap": "soft"}
    layers = [{}, {"caustic": False}] if name == "ball" else [{}]
    pictures, frames_ms = drawn(browser, site, {"view": view, "pictures": PICTURES, "layers": layers})
    wanted = decoded(numpy.fromfile(file, numpy.uint8))
    flip = flip_evaluator.evaluate(wanted, pictures[0], "LDR")[1]
    print(f"WebGPU, {name}: mean FLIP {flip:.4f} beside {told['made_by']}, frame of {WIDTH}x{HEIGHT} {frames_ms[0]:.0f} ms")
    if not flip <= BOUND:
        faults.append(f"WebGPU, {name}")
    if name == "ball":
        differs = lambda a, b: numpy.abs(a - b).max(axis=2) > APART / 255
        shown, dark, bare = pictures
        ball = differs(shown, bare)
        share = float(differs(shown, dark)[ball].mean())
        print(f"WebGPU, ball: a caustic is seen in {100 * share:.1f} % of the ball's {int(ball.sum())} pixels")
        if not share > 0.01:
            faults.append("WebGPU, the caustic behind the ball")
