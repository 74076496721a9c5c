"""A .glb as three.js shows its floor in a browser without a screen."""

import json
import subprocess
import tempfile
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlencode

import numpy

PATIENCE_S = 120


class Handler(SimpleHTTPRequestHandler):
    """Serves the page, three.js and the files, and takes the result."""

    result = None
    done = threading.Event()

    def __init__(self, *arguments, roots, **named):
        self.roots = roots
        super().__init__(*arguments, **named)

    def translate_path(self, path):
        first, _, rest = path.split("?")[0].lstrip("/").partition("/")
        return str(self.roots.get(first, Path("/nowhere")) / rest)

    def do_POST(self):
        length = int(self.headers["Content-Length"])
        Handler.result = json.loads(self.rfile.read(length))
        self.send_response(204)
        self.end_headers()
        Handler.done.set()

    def log_message(self, *arguments):
        pass


def pixels(browser, modules, file, only, area, side, light=None, stops=0):
    """Linear radiance of a square picture from above, row 0 at the least z: array [side, side, 3]. `light`: a KTX 2.0 file
    in the folder of the .glb, which takes the place of its light map, times 2^`stops`."""
    roots = {"modules": modules, "page": Path(__file__).parent, "files": file.parent}
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, roots=roots))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    Handler.done.clear()
    more = {"map": f"/files/{light.relative_to(file.parent)}", "stops": stops} if light else {}
    query = urlencode(more | {"file": f"/files/{file.name}", "only": ",".join(only), "side": side,
                       "area": ",".join(str(value) for value in area)})
    url = f"http://127.0.0.1:{server.server_port}/page/three.html?{query}"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [browser, "--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader",
             f"--user-data-dir={profile}", "--no-first-run", url],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        came = Handler.done.wait(PATIENCE_S)
        process.terminate()
        process.wait()
    server.shutdown()
    if not came:
        raise RuntimeError(f"the browser gave no picture of {file} within {PATIENCE_S} s")
    if "error" in Handler.result:
        raise RuntimeError(f"three.js: {Handler.result['error']}")
    picture = numpy.array(Handler.result["pixels"], dtype=numpy.float64).reshape(side, side, 4)
    # Pixels are read from the bottom; the camera's up is −z.
    return picture[::-1, :, :3], Handler.result["revision"]
