"""A contact sheet of other people's scenes: each as the window draws it beside the CPU, what it warns of, what a bake takes.

    python tests/compare/sheet.py --nephroid target/release/nephroid --scenes DIR --output DIR

needs `pip install numpy pillow flip-evaluator`. Scenes are .glb files of DIR and .gltf files of its folders. Writes sheet.png,
sheet.md and, for each scene, both pictures and the maps that they show.
"""

import argparse
import functools
import json
import resource
import subprocess
import time
from pathlib import Path

import flip_evaluator
import numpy
from PIL import Image, ImageDraw

SIZE = (480, 270)
# Pictures are drawn so many times as large and averaged: the CPU looks once into a pixel.
FINER = 2
QUALITY = ["--max-error", "10%", "--map-resolution", "256", "--default-light"]
# Maps that are seen only; a bake of the caustic alone is timed.
LAYERS = ["--layers", "caustic,direct,indirect", "--max-time", "5s"]
COLUMNS = 2
# Of the mark: mean FLIP, CPU seconds of a bake and of `inspect`.
MARKS = {"flip": 0.02, "bake_s": 15.0, "inspect_s": 2.0}
# CPU seconds after which a run is given up.
LIMIT_S = 240


class Failed(Exception):
    """The program said no, or did not end."""


def run(program, *arguments):
    """Runs Nephroid: what it printed as JSON, and the CPU seconds of all its threads."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [str(part) for part in [program, *arguments, "--json", "--quiet"]]
    limited = functools.partial(resource.setrlimit, resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=limited, check=False)
    if done.returncode < 0:
        raise Failed(f"{arguments[0]}: not done after {LIMIT_S} CPU s")
    if done.returncode != 0:
        raise Failed(f"{arguments[0]}: {done.stderr.strip().splitlines()[-1:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout), taken_s


def look_at(program, scene, folder):
    """A row of the table, and both pictures in `folder`."""
    row = {"file": scene.stem, "failures": []}
    for part in [inspect, bake, draw]:
        try:
            part(program, scene, folder, row)
        except Failed as failure:
            row["failures"].append(str(failure))
    return row


def inspect(program, scene, _, row):
    """What is in it, and what that took."""
    known, row["inspect_s"] = run(program, "inspect", scene, *QUALITY)
    row["triangles"] = known["triangles"]
    row["warnings"] = [f"{warning['location']}: {warning['what']}" for warning in known["warnings"]]
    row["effects"] = [line["effect"] for line in known["plan"]["effects"] if line["on"]]
    row["forecast_s"] = known["presets"][0].get("cpu_s")


def bake(program, scene, folder, row):
    """The caustic alone: CPU seconds of the light pass, and its error."""
    run(program, "bake", scene, "-o", folder / "timed", "--force", *QUALITY)
    timed = json.loads((folder / "timed" / "manifest.json").read_text())
    row["bake_s"] = sum(timed["cpu_s"][part] for part in ["plan", "trace", "deposit"])
    row["estimated"] = timed["error"]["estimated_visible"]


def draw(program, scene, folder, row):
    """By the CPU and as the window does, with the same maps and exposure."""
    run(program, "bake", scene, "-o", folder / "maps", "--force", *QUALITY, *LAYERS)
    stops = "auto"
    for backend in ["cpu", "gpu"]:
        drawn, row[f"{backend}_s"] = run(program, "render", scene, "-o", folder / f"{backend}.png", "--backend", backend,
                                         "--size", "{}x{}".format(*(FINER * side for side in SIZE)), "--maps", folder / "maps",
                                         f"--exposure={stops}")
        stops = drawn["exposure_stops"]
        Image.open(folder / f"{backend}.png").convert("RGB").reduce(FINER).save(folder / f"{backend}.png")
    row["flip"], row["flip_seen"] = flip(folder)


def flip(folder):
    """Mean FLIP of the window's picture against the CPU's: of all pixels, and of those that show something."""
    pictures = [numpy.asarray(Image.open(folder / f"{backend}.png")) for backend in ["cpu", "gpu"]]
    shares = [picture.astype(numpy.float32) / 255 for picture in pictures]
    errors, _, _ = flip_evaluator.evaluate(*shares, "LDR", applyMagma=False)
    is_seen = numpy.any([picture.max(axis=-1) > 0 for picture in pictures], axis=0)
    return float(errors.mean()), float(errors[is_seen].mean()) if is_seen.any() else 0.0


def sheet(rows, output):
    """All pictures: window at the left, CPU at the right, and under them what was found."""
    width, height = 2 * SIZE[0] + 8, SIZE[1] + 22
    lines = -(-len(rows) // COLUMNS)
    whole = Image.new("RGB", (COLUMNS * width, lines * height), (40, 40, 40))
    pen = ImageDraw.Draw(whole)
    for place, row in enumerate(rows):
        left, top = place % COLUMNS * width, place // COLUMNS * height
        for side, backend in enumerate(["gpu", "cpu"]):
            picture = output / row["file"] / f"{backend}.png"
            if picture.exists():
                whole.paste(Image.open(picture), (left + side * SIZE[0], top))
        told = "; ".join([*row["failures"], f"FLIP {cell(row, 'flip', 4)}", f"bake {cell(row, 'bake_s', 1)} CPU s"])
        is_off = row["failures"] or "**" in told
        pen.text((left + 4, top + SIZE[1] + 4), f"{row['file']}: {told}"[:150], fill=(255, 120, 120) if is_off else (230, 230, 230))
    whole.save(output / "sheet.png")


def cell(row, key, digits):
    """A number, bold where it misses its mark."""
    if row.get(key) is None:
        return ""
    text = f"{row[key]:.{digits}f}"
    return f"**{text}**" if row[key] > MARKS.get(key, float("inf")) else text


def table(rows):
    """Markdown; what failed and warnings stand below."""
    lines = ["| scene | triangles | effects | inspect CPU s | FLIP | where seen | bake CPU s | forecast | estimated | window CPU s | CPU s | warnings |",
             "|---|---|---|---|---|---|---|---|---|---|---|---|"]
    for row in rows:
        cells = [row["file"], row.get("triangles", ""), ", ".join(row.get("effects", [])), cell(row, "inspect_s", 1),
                 cell(row, "flip", 4), cell(row, "flip_seen", 4), cell(row, "bake_s", 1), cell(row, "forecast_s", 1), cell(row, "estimated", 3),
                 cell(row, "gpu_s", 1), cell(row, "cpu_s", 1), len(row.get("warnings", []))]
        lines.append("| " + " | ".join(str(part) for part in cells) + " |")
    for row in rows:
        told = [*row["failures"], *row.get("warnings", [])]
        lines += [f"\n{row['file']}:\n", *(f"- {line}" for line in told)] if told else []
    return "\n".join(lines) + "\n"


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nephroid", type=Path, required=True, help="the program, built for release")
    parser.add_argument("--scenes", type=Path, required=True, help="folder of .glb files, or of folders with a .gltf file")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--only", help="NAME,NAME: some of them, the rest as an earlier run found it")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rows = []
    for scene in sorted([*options.scenes.glob("*.glb"), *options.scenes.glob("*/*.gltf")], key=lambda scene: scene.stem.lower()):
        folder = options.output / scene.stem
        folder.mkdir(exist_ok=True)
        found = folder / "row.json"
        if options.only and scene.stem not in options.only.split(",") and found.exists():
            rows.append(json.loads(found.read_text()))
            continue
        began = time.monotonic()
        rows.append(look_at(options.nephroid, scene, folder))
        found.write_text(json.dumps(rows[-1]))
        print(f"{scene.stem}: {time.monotonic() - began:.0f} s, {rows[-1]['failures']} {rows[-1].get('flip')}", flush=True)
    sheet(rows, options.output)
    (options.output / "sheet.md").write_text(table(rows))


if __name__ == "__main__":
    main()
