"""Mitsuba's particle tracer, with a pinhole right above the floor and below all that is specular.

Usage: ptracer.py SCENE.glb FOLDER BUDGET_S SIDE VARIANT

A pinhole that looks straight down sees the floor as a map of even texels, and nothing between. Every particle is deposited,
direct light as well: casters take green out of what they send on, so that red less green is the light that was on one.
"""

import math
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy

import mitsuba_scene
import scene as scenes
import steps

# So dark that what the floor sends back counts for nothing (a 1/10000 of the light on it).
ALBEDO = 1e-4
# As deep as Nephroid's light paths: 16 specular surfaces, the floor and the pinhole.
DEPTH = 18
# Height of the pinhole, of the lowest place of a caster over the floor's middle third.
SHARE_OF_CLEARANCE = 0.5
LARGEST_PASS = 256


def clearance_m(scene):
    """Height over the floor below which nothing is above its middle."""
    middle = numpy.array([scene.x0, scene.z0]) + 0.5 * scene.side_m
    heights = [0.5 * scene.side_m]
    for caster in scene.casters:
        away = numpy.linalg.norm(caster.positions[:, [0, 2]] - middle, axis=1)
        above = caster.positions[away < scene.side_m / 6, 1] - scene.height_m
        heights += [above.min()] if len(above) else []
    return float(min(heights))


def pinhole(scene, side):
    """A camera that sees exactly the floor: columns along x, rows along z."""
    half = 0.5 * scene.side_m
    height_m = SHARE_OF_CLEARANCE * clearance_m(scene)
    eye = [scene.x0 + half, scene.height_m + height_m, scene.z0 + half]
    below = [eye[0], scene.height_m, eye[2]]
    return {
        "type": "perspective", "fov": math.degrees(2 * math.atan(half / height_m)), "near_clip": 1e-3 * height_m,
        "to_world": mi.ScalarTransform4f().look_at(origin=eye, target=below, up=[0, 0, -1]),
        "film": {"type": "hdrfilm", "width": side, "height": side, "pixel_format": "rgb", "component_format": "float32",
                 "rfilter": {"type": "box"}},
    }


def lamp(scene):
    """The scene's lamp, white."""
    light = scene.lamp
    if light.is_sun:
        return {"type": "directional", "direction": list(light.direction), "irradiance": {"type": "rgb", "value": light.amount}}
    return {"type": "point", "position": list(light.position), "intensity": {"type": "rgb", "value": light.amount}}


def main():
    file, folder, budget_s, side, variant = sys.argv[1:]
    side = int(side)
    mi.set_variant(variant)
    scene = scenes.read(file)
    with tempfile.TemporaryDirectory() as meshes:
        loaded = mi.load_dict({
            "type": "scene", "integrator": {"type": "ptracer", "max_depth": DEPTH},
            "sensor": pinhole(scene, side), "lamp": lamp(scene), "floor": mitsuba_scene.floor(mi, scene, ALBEDO),
            **mitsuba_scene.casters(scene, Path(meshes), [1.0, 0.0, 0.0]),
        })

    def trace(samples, seed):
        total, done = numpy.zeros((side, side)), 0
        while done < samples:
            now = min(LARGEST_PASS, samples - done)
            picture = numpy.array(mi.render(loaded, spp=now, seed=1 + (seed << 20) + done), dtype=numpy.float64)
            total += now * (picture[..., 0] - picture[..., 1])
            done += now
        return total / samples * math.pi / ALBEDO

    trace(1, 4095)  # compiles kernels, before the clock runs
    steps.take(folder, float(budget_s), 4, trace, pooled=True, rays_per_sample=side * side)


main()
