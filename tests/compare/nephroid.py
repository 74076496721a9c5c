"""Bakes by Nephroid, written as the steps of the other programs are."""

import json
import subprocess

import numpy
import OpenEXR

TARGETS = [0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005]
# Rays per steradian; under a sun, of the casters seen from their farthest receiver.
DENSITIES = [5e4 * 2**power for power in range(14)]
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
    run(program, "bake", f"builtin:{name}", "-o", maps, "--density", "1000", "--map-resolution", "32", "--quiet")
    run(program, "export", maps, "-o", file, "--lights", "keep")
    return file


def take(program, scene, folder, budget_s, side, estimator):
    """Bakes with smaller and smaller errors (wavefront) or denser and denser rays (splat), each within the budget.

    Seconds are those of the light pass, of all threads; loading and the hierarchy are apart. Every bake has its own seed.
    """
    steps, growth = [], 2.0
    for number, value in enumerate(TARGETS if estimator == "wavefront" else DENSITIES):
        quality = ["--max-error", f"{100 * value:g}%"] if estimator == "wavefront" else ["--density", value]
        maps = folder / "maps"
        run(program, "bake", scene, "-o", maps, "--estimator", estimator, *quality, "--seed", number,
            "--map-resolution", side, "--quiet", "--force", "--no-cache")
        manifest = json.loads((maps / "manifest.json").read_text())
        taken_s = sum(manifest["cpu_s"][part] for part in ["plan", "trace", "deposit"])
        if taken_s > budget_s:
            break
        numpy.save(folder / f"step_{number:02}.npy", floor_of(maps, manifest))
        steps.append({"cpu_s": taken_s, "samples": value, "rays": manifest["counts"]["rays"],
                      "before_s": manifest["cpu_s"]["load"] + manifest["cpu_s"]["build"],
                      "estimated": manifest["error"]["estimated_relative_rmse"]})
        (folder / "steps.json").write_text(json.dumps(steps))
        growth = taken_s / steps[-2]["cpu_s"] if len(steps) > 1 else growth
        if taken_s * growth > budget_s:
            break


def floor_of(maps, manifest):
    """Irradiance of the floor's caustic [W/m²], of luminance."""
    entry = next(entry for entry in manifest["maps"] if entry["surface"] == "floor")
    channels = OpenEXR.File(str(maps / entry["file"]), separate_channels=True).parts[0].channels
    return numpy.stack([channels[f"caustic.{name}"].pixels for name in "RGB"], axis=-1).astype(float) @ LUMINANCE
