"""Bakes by Nephroid, written as the steps of the other programs are."""

import json
import math
import subprocess
from pathlib import Path

import numpy
import OpenEXR

import glass
import scene as scenes
from steps import ALIKE_SEED

TARGETS = [0.4, 0.2, 0.14, 0.1, 0.07, 0.05, 0.03, 0.02, 0.014, 0.01, 0.007, 0.005, 0.002, 0.001, 0.0005]
# Rays per steradian; under a sun, of the casters seen from their farthest receiver.
DENSITIES = [5e4 * 2**power for power in range(14)]
# Of brute force, for each map.
LEAST_RAYS = 100_000
# Of brute force in dispersive glass.
WAVELENGTHS = 24
SPECTRA = Path(__file__).parent.parent.parent / "assets" / "spectra"
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])


def run(*command):
    """Runs Nephroid; what it printed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(str(part) for part in command)}: {done.stderr.strip()}")
    return done.stdout


def export_scene(program, name, folder):
    """A built-in scene as a .glb file, by way of a coarse bake."""
    maps, file = folder / f"{name}_maps", folder / f"{name}.glb"
    run(program, "bake", f"builtin:{name}", "-o", maps, "--density", "1000", "--map-resolution", "32", "--quiet", "--force")
    run(program, "export", maps, "-o", file, "--lights", "keep")
    return file


def bake(program, scene, maps, side, estimator, quality, seed):
    """Bakes the floor's caustic: (map, manifest, CPU seconds of the light pass)."""
    unfiltered = ["--filter", "off"] if estimator == "photon" else []
    run(program, "bake", scene.file, "-o", maps, "--estimator", estimator, *quality, *unfiltered, "--seed", seed,
        "--map-resolution", side, "--quiet", "--force", "--no-cache")
    manifest = json.loads((maps / "manifest.json").read_text())
    taken_s = sum(manifest["cpu_s"][part] for part in ["plan", "trace", "deposit"])
    return floor_of(maps, manifest), manifest, taken_s


def quality_of(estimator, value):
    """Options for a target, or for rays per steradian of splats."""
    if estimator == "splat":
        return ["--density", value]
    return ["--max-error", f"{100 * value:.4g}%", "--error-metric", "rmse"]


def take(program, scene, folder, budget_s, side, estimator, alike=0):
    """Bakes with smaller and smaller errors, or denser and denser rays (splat), each within the budget.

    Seconds are those of the light pass, of all threads; loading and the hierarchy are apart. Every bake has its own seed.
    `alike` bakes that differ by their seeds alone take the budget once more, together.
    """
    steps, growth, maps = [], 2.0, folder / "maps"
    for number, value in enumerate(DENSITIES if estimator == "splat" else TARGETS):
        irradiance, manifest, taken_s = bake(program, scene, maps, side, estimator, quality_of(estimator, value), number)
        if taken_s > budget_s and len(steps) > 1:
            break
        numpy.save(folder / f"step_{number:02}.npy", irradiance)
        steps.append({"cpu_s": taken_s, "samples": value, "rays": manifest["counts"]["rays"],
                      "before_s": manifest["cpu_s"]["load"] + manifest["cpu_s"]["build"],
                      "estimated": manifest["error"]["estimated_relative_rmse"]})
        (folder / "steps.json").write_text(json.dumps(steps))
        growth = taken_s / steps[-2]["cpu_s"] if len(steps) > 1 else growth
        # Two steps at least tell a slope.
        if taken_s * growth > budget_s and len(steps) > 1:
            break
    if alike:
        target = min(steps[-1]["estimated"] * math.sqrt(steps[-1]["cpu_s"] * alike / budget_s), 1.0)
        quality = quality_of(estimator, target)
        found = [bake(program, scene, maps, side, estimator, quality, ALIKE_SEED + seed)[0] for seed in range(alike)]
        numpy.save(folder / "alike.npy", found)


def brute_force(program, scene, folder, budget_s, side, alike):
    """Maps by brute force, which differ by their seeds alone and take the budget together, or more where it is too short."""
    is_dispersive = scenes.read(scene.file).is_dispersive
    found, rays, maps = [], LEAST_RAYS, folder / "maps"
    while len(found) < alike:
        seed = ALIKE_SEED + len(found)
        files = by_wavelength(scene.file, folder, seed) if is_dispersive else [scene.file]
        total, taken_s = numpy.zeros((side, side)), 0.0
        for file in files:
            run(program, "study", "reference", file, "-o", maps, "--rays", max(rays // len(files), 1000), "--seed", seed,
                "--map-resolution", side, "--quiet", "--force", "--no-cache")
            manifest = json.loads((maps / "reference.json").read_text())
            total += floor_of(maps, manifest) / len(files)
            taken_s += manifest["cpu_s"]
        wanted = int(rays * budget_s / alike / taken_s)
        if not found and wanted > 2 * rays:
            rays = wanted
            continue
        found.append(total)
    numpy.save(folder / "alike.npy", found)


def by_wavelength(file, folder, seed):
    """Copies of a scene with the refractive indices of single wavelengths, at random within parts that are equally bright under
    D65: brute force, which has no wavelengths, then has them."""
    observer, daylight = (numpy.loadtxt(SPECTRA / name, delimiter=",", skiprows=1) for name in ["cie_1931_2deg.csv", "d65.csv"])
    brightness = numpy.cumsum(observer[:, 2] * numpy.interp(observer[:, 0], daylight[:, 0], daylight[:, 1]))
    places = (numpy.arange(WAVELENGTHS) + numpy.random.default_rng(seed).random(WAVELENGTHS)) / WAVELENGTHS
    wavelengths_nm = numpy.interp(places, brightness / brightness[-1], observer[:, 0])
    document, binary = scenes.chunks(file.read_bytes())
    copies = []
    for number, wavelength_nm in enumerate(wavelengths_nm):
        copy = glass.File(json.loads(json.dumps(document)), binary)
        for material in copy.document["materials"]:
            extensions = material.get("extensions", {})
            dispersion = extensions.pop("KHR_materials_dispersion", {}).get("dispersion", 0.0)
            if dispersion > 0.0:
                # KHR_materials_dispersion, after Cauchy.
                index = extensions["KHR_materials_ior"]["ior"]
                steep = (index - 1.0) * dispersion / 20.0
                extensions["KHR_materials_ior"]["ior"] = index + steep * (523655.0 / wavelength_nm**2 - 1.5168)
        copies.append(folder / f"wavelength_{number:02}.glb")
        copy.write(copies[-1])
    return copies


def floor_of(maps, manifest):
    """Irradiance of the floor's caustic [W/m²], of luminance."""
    entry = next(entry for entry in manifest["maps"] if entry["surface"] == "floor")
    channels = OpenEXR.File(str(maps / entry["file"]), separate_channels=True).parts[0].channels
    return numpy.stack([channels[f"caustic.{name}"].pixels for name in "RGB"], axis=-1).astype(float) @ LUMINANCE
