"""What other programs make of our files: Khronos' validator, three.js in a browser, Blender, Bevy; and our own page.

Usage: interop.py NEPHROID BEVY MODULES BROWSER SCENES... (SCENES: other files to export and validate)
Each figure is a mean over blocks of pixels of the floor, against the radiance that our own maps say.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy
import OpenEXR

import page
import textures
from three_pixels import pixels as three_pixels

HERE = Path(__file__).parent
LUMENS_PER_WATT = 683.0
SIDE = 256
# Largest difference of a block of 16 x 16 pixels [1], of blocks with light.
BOUND = 0.02
BLOCK = 16
# Of light maps in RGB9E5, which ends at 65408 [stops]: foci are brighter in lux.
STOPS = -4
# Floors of the built-in scenes: half width [m] is read from the map's texel area.
SCENES = ["ring", "ball", "pool"]

faults = []


def run(*command, cwd=None):
    """Runs a program; its output, or the end of everything."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=cwd)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(part) for part in command)}:\n{done.stdout}{done.stderr}")
    return done.stdout


def baked(folder, surface, frame=None):
    """E of a surface's map [W/m²], array [height, width, 3], row 0 at v = 0, of a frame (from 0) where there are several;
    the side of a texel [m] and the file."""
    manifest = json.loads((folder / "manifest.json").read_text())
    moment = manifest if frame is None else manifest["sequence"]["frames"][frame]
    entry = next(entry for entry in moment["maps"] if entry["surface"] == surface)
    image = OpenEXR.File(str(folder / entry["file"]), separate_channels=True)
    channels = image.parts[0].channels
    light = numpy.stack([channels[name].pixels for name in "RGB"], axis=-1)
    return light, entry["texel_area_m2"] ** 0.5, folder / entry["file"]


def blocks(picture):
    """Means over blocks of luminance."""
    luminance = picture @ numpy.array([0.2126, 0.7152, 0.0722])
    side = luminance.shape[0] // BLOCK
    return luminance.reshape(side, BLOCK, side, BLOCK).mean(axis=(1, 3))


def wholly_lit(picture):
    """Blocks that no shadow's border crosses, nor lie in one."""
    luminance = picture @ numpy.array([0.2126, 0.7152, 0.0722])
    side = luminance.shape[0] // BLOCK
    block = luminance.reshape(side, BLOCK, side, BLOCK)
    low, high = block.min(axis=(1, 3)), block.max(axis=(1, 3))
    return (low > 0.8 * high) & (low > 0)


def compare(what, found, wanted):
    """Prints how far two pictures are apart, and keeps it where that is too far."""
    found, wanted = blocks(found), blocks(wanted)
    has_light = wanted > 0.05 * wanted.mean()
    relative = numpy.abs(found / numpy.maximum(wanted, 1e-30) - 1.0)
    worst = numpy.unravel_index(numpy.where(has_light, relative, 0.0).argmax(), relative.shape)
    ratio = float(found.sum() / wanted.sum())
    print(f"{what}: worst block off by {100 * relative[worst]:.2f} %, whole floor {ratio:.4f} of ours")
    if relative[worst] > BOUND or abs(ratio - 1.0) > BOUND:
        faults.append(what)


def interpolated(picture):
    """Means over texels of what goes linearly from the middle of one to the next."""
    for axis in (0, 1):
        around = [(1, 1) if axis == other else (0, 0) for other in range(3)]
        wide = numpy.moveaxis(numpy.pad(picture, around, mode="edge"), axis, 0)
        picture = numpy.moveaxis(wide[:-2] / 8 + wide[1:-1] * 3 / 4 + wide[2:] / 8, 0, axis)
    return picture


def floor_of(name, folder, nephroid, layers):
    """Bakes a built-in scene; its folder, E of its floor and the floor's area seen from above."""
    run(nephroid, "bake", f"builtin:{name}", "-o", folder, "--layers", layers, "--map-resolution", SIDE,
        "--density", "1e5", "--quiet", "--force")
    light, texel_m, _ = baked(folder, "floor")
    half = 0.5 * SIDE * texel_m
    return light, (-half, -half, half, half)


def check_three(name, nephroid, modules, browser, folder):
    """Light maps in lux beside lights in candela: the caustic layer, and direct light baked against lit live."""
    albedo = 0.5
    light, area = floor_of(name, folder / name, nephroid, "caustic")
    file = folder / f"{name}.glb"
    run(nephroid, "export", folder / name, "-o", file, "--units", "lux", "--lights", "remove")
    shared = folder / f"{name}_shared"
    run(nephroid, "export", folder / name, "-o", shared, "--format", "ktx2", "--units", "lux", "--exposure", STOPS)
    texture = json.loads((shared / "index.json").read_text())["textures"][0]["file"]
    found, revision = three_pixels(browser, modules, file, ["floor"], area, SIDE, shared / texture, STOPS)
    wanted = light * LUMENS_PER_WATT * albedo / numpy.pi
    compare(f"three.js r{revision}, {name}, caustic map in RGB9E5", found, wanted)
    numpy.save(folder / f"{name}_three.npy", found)

    direct, area = floor_of(name, folder / f"{name}_direct", nephroid, "caustic,direct")
    kept_file = folder / f"{name}_live.glb"
    run(nephroid, "export", folder / name, "-o", kept_file, "--units", "lux", "--lights", "keep")
    kept, _ = three_pixels(browser, modules, kept_file, ["floor"], area, SIDE)
    whole = folder / f"{name}_whole.glb"
    run(nephroid, "export", folder / f"{name}_direct", "-o", whole, "--units", "lux")
    all_baked, _ = three_pixels(browser, modules, whole, ["floor"], area, SIDE)
    # Where no caster hides the lamp (three.js casts no shadows unless it is told to), a floor lit live and by its caustic
    # shows what one lit by its maps alone does.
    alone = baked(folder / f"{name}_direct", "floor")[0] - light
    is_lit = wholly_lit(alone)
    if not is_lit.any():
        print(f"three.js r{revision}, {name}: the lamp lights no block of the floor all over")
        return [file, kept_file, whole]
    live, maps = blocks(kept)[is_lit], blocks(all_baked)[is_lit]
    off = float(numpy.abs(live / maps - 1.0).max())
    print(f"three.js r{revision}, {name}, live light beside maps: median {numpy.median(live / maps):.4f}, worst {100 * off:.2f} %")
    if abs(numpy.median(live / maps) - 1.0) > BOUND:
        faults.append(f"{name}: lit live and by maps")
    return [file, kept_file, whole]


def check_blender(name, nephroid, folder):
    """Emission in W/(m² sr)."""
    albedo = 0.5
    light, texel_m, _ = baked(folder / name, "floor")
    half = 0.5 * SIDE * texel_m
    area = ",".join(str(value) for value in (-half, -half, half, half))
    file = folder / f"{name}_emissive.glb"
    run(nephroid, "export", folder / name, "-o", file, "--as", "emissive", "--units", "E", "--lights", "remove",
        "--cut", "0")
    out = folder / f"{name}_blender.npy"
    told = run(sys.executable, HERE / "blender_pixels.py", file, out, "floor", area, SIDE)
    version = next(line for line in told.splitlines() if line.startswith("blender "))
    compare(f"{version}, {name}, emission", numpy.load(out), interpolated(light) * albedo / numpy.pi)
    return [file]


def check_bevy(name, nephroid, bevy, folder):
    """`Lightmap` in lux/pi, in luminance [cd/m²], on the .glb that three.js had."""
    albedo = 0.5
    light, texel_m, _ = baked(folder / name, "floor")
    textures = folder / f"{name}_lux_pi"
    run(nephroid, "export", folder / name, "-o", textures, "--format", "ktx2", "--units", "lux/pi", "--exposure", STOPS)
    out = folder / f"{name}_bevy.f32"
    run(bevy, folder / f"{name}.glb", textures.name, out, 0.5 * SIDE * texel_m, SIDE)
    found = numpy.fromfile(out, numpy.float32).reshape(SIDE, SIDE, 4)[..., :3].astype(numpy.float64)
    version = tomllib.loads((HERE / "bevy/Cargo.toml").read_text())["dependencies"]["bevy"]["version"].lstrip("=")
    compare(f"Bevy {version}, {name}, Lightmap in RGB9E5", found, light * LUMENS_PER_WATT * albedo / numpy.pi)


def check_sequence(nephroid, browser, folder):
    """Maps of moving water on a plane in Blender, where each frame shows its own, and in the page."""
    frames = 3
    run(nephroid, "bake", "builtin:pool", "-o", folder, "--frames", frames, "--fps", "8", "--map-resolution", SIDE,
        "--density", "1e5", "--quiet")
    maps = [baked(folder, "floor", frame) for frame in range(frames)]
    half = 0.5 * SIDE * maps[0][1]
    area = ",".join(str(value) for value in (-half, -half, half, half))
    out = folder / "sequence.npy"
    told = run(sys.executable, HERE / "blender_pixels.py", maps[0][2], out, "floor", area, SIDE, frames)
    version = next(line for line in told.splitlines() if line.startswith("blender "))
    found = numpy.load(out)
    for frame, (light, _, _) in enumerate(maps):
        compare(f"{version}, pool, frame {frame + 1} of {frames}", found[frame], interpolated(light))
    page.check(nephroid, browser, "builtin:pool", folder, folder.with_name("sequence_page"), run, faults)
    moved = numpy.abs(blocks(found[1]) / blocks(found[0]) - 1.0).max()
    print(f"pool: blocks change by up to {100 * moved:.0f} % from frame to frame")
    if moved < 5 * BOUND:
        faults.append("a sequence in which nothing moves")


def main():
    nephroid, bevy, modules, browser, *others = sys.argv[1:]
    nephroid, bevy, modules = (Path(path).resolve() for path in (nephroid, bevy, modules))
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        files = []
        for name in SCENES:
            files += check_three(name, nephroid, modules, browser, folder)
            files += check_blender(name, nephroid, folder)
            check_bevy(name, nephroid, bevy, folder)
            page.check(nephroid, browser, f"builtin:{name}", folder / f"{name}_direct", folder / f"{name}_page", run, faults)
            textures.check(nephroid, modules, folder / name, folder / f"{name}_textures", run, faults)
        gallery = folder / "gallery"
        run(nephroid, "bake", "builtin:gallery", "-o", gallery, "--layers", "caustic,direct,indirect", "--quiet")
        page.check(nephroid, browser, "builtin:gallery", gallery, folder / "gallery_page", run, faults)
        water = folder / "water-room"
        run(nephroid, "bake", "builtin:water-room", "-o", water, "--frames", 3, "--fps", 8, "--map-resolution", 2 * SIDE,
            "--layers", "caustic,direct", "--preset", "preview", "--quiet")
        page.check(nephroid, browser, "builtin:water-room", water, folder / "water_page", run, faults)
        check_sequence(nephroid, browser, folder / "sequence")
        for number, scene in enumerate(others):
            maps = folder / f"other{number}"
            run(nephroid, "bake", scene, "-o", maps, "--default-light", "--density", "2000", "--map-resolution", "64",
                "--quiet", "--layers", "caustic,direct")
            for carrier in ["lightmap", "emissive", "unlit"]:
                file = folder / f"other{number}_{carrier}.glb"
                run(nephroid, "export", maps, "-o", file, "--as", carrier)
                files.append(file)
        told = subprocess.run(["node", str(HERE / "validate.mjs"), *map(str, files)], cwd=modules.parent,
                              capture_output=True, text=True)
        print(told.stdout, told.stderr)
        if told.returncode != 0:
            faults.append("the validator's errors")
    if faults:
        sys.exit("interop: " + "; ".join(faults))


main()
