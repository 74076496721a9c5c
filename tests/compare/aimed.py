"""What somebody who knows how writes on Mitsuba's intersector: rays aimed at what is specular, stratified, into texels.

Usage: aimed.py SCENE.glb FOLDER BUDGET_S SIDE line|beside

Rays fill the casters' bounding cone around a lamp, or their bounding rectangle across a sun's light, one in each cell of a
square grid. Mitsuba chooses between reflection and refraction, by numbers that are even among neighbours. A ray that goes on
starts a little further on its own line; or beside it, where Mitsuba's `spawn_ray` has it, as all of Mitsuba's integrators do.
"""

import math
import sys
import tempfile
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy

mi.set_variant("llvm_ad_rgb")

import mitsuba_scene
import scene as scenes
import steps

DEPTH = 16
STEP_M = 1e-4
LARGEST_PASS = 1 << 22
FIRST_THOUSANDS = 500
# Steps along a grid's two axes whose sums are spread evenly over [0, 1): 0.7549 and 0.5698 (powers of the root of
# x³ = x + 1), in units of 2⁻³², so that they wrap around exactly.
EVEN_STEPS = (3242174889, 2447445414)


def axes_across(direction):
    """Two unit vectors across a direction and each other."""
    first = numpy.cross(direction, numpy.eye(3)[numpy.argmin(numpy.abs(direction))])
    first /= numpy.linalg.norm(first)
    return first, numpy.cross(direction, first)


def cone(lamp, points):
    """Rays of a point light within its casters' bounding cone: (from two numbers to a ray, watts of all)."""
    towards = points - lamp.position
    towards /= numpy.linalg.norm(towards, axis=1, keepdims=True)
    axis = towards.mean(axis=0)
    axis /= numpy.linalg.norm(axis)
    least = float((towards @ axis).min())
    first, second = (mi.Vector3f(side) for side in axes_across(axis))
    origin, along = mi.Point3f(lamp.position), mi.Vector3f(axis)

    def ray(u, v):
        up = dr.lerp(1.0, least, u)
        out = dr.safe_sqrt(1.0 - up * up)
        sine, cosine = dr.sincos(2.0 * math.pi * v)
        return mi.Ray3f(origin, up * along + out * (cosine * first + sine * second))

    return ray, lamp.amount * 2.0 * math.pi * (1.0 - least)


def rectangle(lamp, points):
    """Rays of a sun within its casters' bounding rectangle: (from two numbers to a ray, watts of all)."""
    sides = numpy.stack(axes_across(lamp.direction))
    across, depth = points @ sides.T, (points @ lamp.direction).min() - 1.0
    low, size = across.min(axis=0), numpy.ptp(across, axis=0)
    corner = mi.Point3f(low @ sides + depth * lamp.direction)
    first, second = (mi.Vector3f(length * side) for length, side in zip(size, sides))
    direction = mi.Vector3f(lamp.direction)
    return lambda u, v: mi.Ray3f(corner + u * first + v * second, direction), lamp.amount * float(size.prod())


def onwards(hit, direction, is_beside):
    """A ray that goes on from a surface."""
    return hit.spawn_ray(direction) if is_beside else mi.Ray3f(hit.p + STEP_M * direction, direction)


@dr.syntax
def land(loaded, floor, ray, choice, is_beside):
    """Follows rays over specular surfaces: where they end, and whether on the floor after at least one of them.

    One number in [0, 1) makes all choices of a ray: what is left of it after one serves for the next.
    """
    context = mi.BSDFContext(mi.TransportMode.Importance)
    depth, going, landed = mi.UInt32(0), mi.Bool(True), mi.Bool(False)
    while going:
        hit = loaded.ray_intersect(ray, going)
        on_floor = hit.shape == floor
        landed = hit.is_valid() & on_floor & (depth > 0)
        going = hit.is_valid() & ~on_floor & (depth < DEPTH)
        ray.maxt = dr.select(landed, hit.t, ray.maxt)
        sample, _ = hit.bsdf().sample(context, hit, choice, mi.Point2f(0.5), going)
        is_reflected = mi.has_flag(sample.sampled_type, mi.BSDFFlags.DeltaReflection)
        choice = dr.select(going, dr.select(is_reflected, choice, choice - 1.0 + sample.pdf) / sample.pdf, choice)
        ray = dr.select(going, onwards(hit, hit.to_world(sample.wo), is_beside), ray)
        depth += 1
    return ray(ray.maxt), landed


def main():
    file, folder, budget_s, side, origins = sys.argv[1:]
    side = int(side)
    scene = scenes.read(file)
    points = numpy.vstack([caster.positions for caster in scene.casters])
    aim, watts = (rectangle if scene.lamp.is_sun else cone)(scene.lamp, points)
    with tempfile.TemporaryDirectory() as meshes:
        loaded = mi.load_dict({"type": "scene", "floor": mitsuba_scene.floor(mi, scene, 0.5),
                               **mitsuba_scene.casters(scene, Path(meshes), [1.0, 1.0, 1.0])})
    floor = mi.ShapePtr(next(shape for shape in loaded.shapes() if shape.id() == "floor"))

    def rows(cells, start, count, seed):
        """Hits per texel of `count` rays, one in each cell from the cell `start` on."""
        random = mi.PCG32(count, initstate=seed)
        cell = dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, start)
        width = dr.opaque(mi.UInt32, cells)
        down, across = cell // width, cell % width
        u = (down + random.next_float32()) / mi.Float(width)
        v = (across + random.next_float32()) / mi.Float(width)
        turn = down * EVEN_STEPS[0] + across * EVEN_STEPS[1] + dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
        place, landed = land(loaded, floor, aim(u, v), mi.Float(turn >> 8) * 2.0**-24, origins == "beside")
        column = mi.Int32((place.x - scene.x0) * (side / scene.side_m))
        row = mi.Int32((place.z - scene.z0) * (side / scene.side_m))
        inside = landed & (column >= 0) & (column < side) & (row >= 0) & (row < side)
        hits = dr.zeros(mi.Float, side * side)
        dr.scatter_add(hits, 1.0, mi.UInt32(row * side + column), inside)
        return hits.numpy().astype(numpy.float64)

    def trace(thousands, seed):
        cells = math.isqrt(1000 * thousands)
        total = numpy.zeros(side * side)
        for start in range(0, cells * cells, LARGEST_PASS):
            total += rows(cells, start, min(LARGEST_PASS, cells * cells - start), (seed << 32) + start)
        return (total * watts / cells**2 / (scene.side_m / side) ** 2).reshape(side, side)

    trace(1, 4095)  # compiles kernels, before the clock runs
    steps.take(folder, float(budget_s), FIRST_THOUSANDS, trace, pooled=False, rays_per_sample=1000)


main()
