"""Exported textures read by others: OpenEXR, OpenCV (PNG, Radiance), ktx-parse with zstddec (KTX 2.0)."""

import json
from pathlib import Path

import cv2
import numpy
import OpenEXR

HERE = Path(__file__).parent
RGB9E5, BC6H = 123, 143


def channels(file):
    """R, G, B of an OpenEXR file [height, width, 3], and the type that they are stored as."""
    image = OpenEXR.File(str(file), separate_channels=True)
    named = image.parts[0].channels
    return numpy.stack([named[name].pixels for name in "RGB"], axis=-1), named["R"].pixels.dtype


# Halves and shared exponents have steps of equal width below that.
LEAST = 2.0 ** -14


def off(found, wanted):
    """Largest difference of a channel, in parts of the largest channel of its texel."""
    found, wanted = (numpy.asarray(values, dtype=numpy.float64) for values in (found, wanted))
    largest = numpy.maximum(numpy.abs(wanted).max(axis=-1, keepdims=True), LEAST)
    return float((numpy.abs(found - wanted) / largest).max())


def check(nephroid, modules, maps, folder, run, faults):
    """Writes the maps of a folder in every format, reads them back and prints how far off they are."""

    def export(name, *options):
        run(nephroid, "export", maps, "-o", folder / name, *options)
        index = json.loads((folder / name / "index.json").read_text())
        texture = index["textures"][0]
        return folder / name / texture["file"], 2.0 ** index["exposure_stops"], texture

    def told(what, value, bound):
        print(f"{what}: off by {value:.2e} of the texel, bound {bound:.2e}")
        if not value <= bound:
            faults.append(what)

    own = maps / json.loads((maps / "manifest.json").read_text())["maps"][0]["file"]
    whole = channels(own)[0]
    light = numpy.maximum(whole, 0.0)
    for bits, kind, bound in [("32", numpy.float32, 0.0), ("16", numpy.float16, 2.0 ** -11)]:
        found, stored = channels(export(f"exr{bits}", "--format", "exr", "--bits", bits)[0])
        told(f"OpenEXR {OpenEXR.__version__}, {bits} bits", off(found, whole), bound)
        if stored != kind:
            faults.append(f"{bits} bits are stored as {stored}")
    file, factor, _ = export("png", "--format", "png", "--cut", "0", "--transfer", "linear")
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[:, :, ::-1]
    # Half a step of 1/65535, beside the brightest of all.
    wanted = light * factor
    step = float(numpy.abs(found / 65535.0 - wanted).max())
    told("PNG by OpenCV", step, 0.51 / 65535.0)
    file, factor, _ = export("hdr", "--format", "hdr")
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[:, :, ::-1]
    told("Radiance by OpenCV", off(found, light * factor), 1.01 / 256.0)
    files = [export(name, "--format", "ktx2", *options)[0] for name, options in
             [("shared", []), ("blocks", ["--packing", "bc6h", "--mips"])]]
    lines = run("node", HERE / "ktx2.mjs", *files, cwd=modules.parent).splitlines()
    shared, blocks = (json.loads(line) for line in lines)
    height, width, _ = light.shape
    told("KTX 2.0 Rgb9e5 by ktx-parse", off(numpy.reshape(shared["values"], light.shape), light), 1.01 / 512.0)
    for container, wanted in [
        (shared, {"vkFormat": RGB9E5, "typeSize": 4, "levels": 1, "model": 1, "samples": 6}),
        (blocks, {"vkFormat": BC6H, "typeSize": 1, "levels": max(width, height).bit_length(), "model": 133, "samples": 1}),
    ]:
        wanted |= {"pixelWidth": width, "pixelHeight": height, "supercompressionScheme": 2}
        wrong = {key: container[key] for key, value in wanted.items() if container[key] != value}
        if wrong or container["text"].get("KTXorientation", "").strip("\0") != "rd":
            faults.append(f"KTX 2.0: {wrong}")
