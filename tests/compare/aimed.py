"""What somebody who knows how writes on Mitsuba's intersector: rays aimed at what is specular, stratified, into texels.

Usage: aimed.py SCENE.glb FOLDER BUDGET_S SIDE DEPTH SAMPLES line|beside

Rays fill the casters' bounding cone around a lamp, or their bounding rectangle across a sun's light, one in each cell of a
square grid; of lamps with a size, the cone or disc of the casters' bounding ball, from a place that is drawn. At every surface
a ray goes one way, by Fresnel, by numbers that are even among neighbours. It starts a little further on its own line; or
beside it, where Mitsuba's `spawn_ray` has it, as all of Mitsuba's integrators do.

Surfaces are those that Nephroid's guide describes: the triangle says which side is met, and turns light where its interpolated
normal would send it through; rough ones show GGX micro-normals and lose nothing between them; of bodies that overlap, the one
that was entered last is the medium.
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

# Of the floor's side.
STEP = 2e-5
SMOOTH = 0.01  # roughness up to which there is no lobe
LARGEST_PASS = 1 << 22
FIRST_THOUSANDS = 500
# Steps along a grid's two axes whose sums are spread evenly over [0, 1): 0.7549 and 0.5698 (powers of the root of
# x³ = x + 1), in units of 2⁻³², so that they wrap around exactly.
EVEN_STEPS = (3242174889, 2447445414)
LAST_DIGIT = 2.0**-24
# Spreads seeds over where those begin.
HASH = 0x9E3779B97F4A7C15


def fixed(value):
    """A value that is no part of a kernel, so that lamps share one."""
    dr.make_opaque(value)
    return value


def vector(values):
    """Three numbers for Mitsuba."""
    return fixed(mi.Vector3f(*map(float, values)))


def axes_across(direction):
    """Two unit vectors across a direction and each other."""
    first = numpy.cross(direction, numpy.eye(3)[numpy.argmin(numpy.abs(direction))])
    first /= numpy.linalg.norm(first)
    return first, numpy.cross(direction, first)


def in_cone(frame, least, u, v):
    """A direction within a cone around a frame's z, of cosines from `least` to 1, evenly by solid angle."""
    up = dr.lerp(1.0, least, u)
    sine, cosine = dr.sincos(2.0 * math.pi * v)
    out = dr.safe_sqrt(1.0 - up * up)
    return frame.to_world(mi.Vector3f(out * cosine, out * sine, up))


def falloff(lamp, direction):
    """What a spot sends off its axis (KHR_lights_punctual), and a panel."""
    cosine = dr.dot(vector(lamp.direction), direction)
    if lamp.kind == "panel":
        return dr.maximum(cosine, 0.0)
    if lamp.kind != "spot":
        return mi.Float(1.0)
    inner, outer = map(math.cos, lamp.cone_rad)
    return dr.clip((cosine - outer) / max(inner - outer, 1e-6), 0.0, 1.0) ** 2


def cone(lamp, points):
    """Rays of a lamp at one place within its casters' bounding cone, or its own: (to a ray and its share, watts of all)."""
    towards = points - lamp.position
    towards /= numpy.linalg.norm(towards, axis=1, keepdims=True)
    axis = towards.mean(axis=0) / max(numpy.linalg.norm(towards.mean(axis=0)), 1e-6)
    least = float((towards @ axis).min())
    # Casters that are on all sides.
    least = -1.0 if least < 0.0 else least
    if lamp.kind == "spot" and math.cos(lamp.cone_rad[1]) > least:
        axis, least = lamp.direction, math.cos(lamp.cone_rad[1])
    origin, frame, limit = mi.Point3f(vector(lamp.position)), mi.Frame3f(vector(axis)), fixed(mi.Float(least))

    def ray(u, v, _):
        direction = in_cone(frame, limit, u, v)
        return mi.Ray3f(origin, direction), falloff(lamp, direction)

    return ray, lamp.amount * 2.0 * math.pi * (1.0 - least)


def rectangle(lamp, points):
    """Rays of a sun within its casters' bounding rectangle."""
    sides = numpy.stack(axes_across(lamp.direction))
    across, depth = points @ sides.T, (points @ lamp.direction).min() - 1.0
    low, size = across.min(axis=0), numpy.ptp(across, axis=0)
    corner = mi.Point3f(vector(low @ sides + depth * lamp.direction))
    first, second = (vector(length * side) for length, side in zip(size, sides))
    direction = vector(lamp.direction)
    return lambda u, v, _: (mi.Ray3f(corner + u * first + v * second, direction), mi.Float(1.0)), lamp.amount * float(size.prod())


def ball_around(points):
    """Middle and radius of what bounds all casters."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle, float(numpy.linalg.norm(points - middle, axis=1).max())


def place_of(lamp, random):
    """A place of a lamp with a size, and the normal of what shines there."""
    a, b = 2.0 * random.next_float32() - 1.0, 2.0 * random.next_float32() - 1.0
    middle, normal = mi.Point3f(vector(lamp.position)), vector(lamp.direction)
    if lamp.kind == "panel":
        first, second = map(vector, lamp.half_axes_m)
        return middle + a * first + b * second, normal
    if lamp.kind == "spot":
        disc = mi.warp.square_to_uniform_disk_concentric(0.5 + 0.5 * mi.Point2f(a, b))
        frame = mi.Frame3f(normal)
        return middle + lamp.radius_m * (disc.x * frame.s + disc.y * frame.t), normal
    normal = mi.warp.square_to_uniform_sphere(0.5 + 0.5 * mi.Point2f(a, b))
    return middle + lamp.radius_m * normal, normal


def wide_cone(lamp, points):
    """Rays of a lamp with a size: from each place within the cone of the casters' ball."""
    middle, radius_m = ball_around(points)
    strength = lamp.amount
    if lamp.kind == "panel":
        strength *= 4.0 * float(numpy.linalg.norm(numpy.cross(*lamp.half_axes_m)))

    def ray(u, v, random):
        place, normal = place_of(lamp, random)
        towards = mi.Point3f(vector(middle)) - place
        sine2 = radius_m**2 / dr.squared_norm(towards)
        least = dr.select(sine2 < 1.0, dr.safe_sqrt(1.0 - sine2), -1.0)
        direction = in_cone(mi.Frame3f(dr.normalize(towards)), least, u, v)
        # A ball of radiance I/(πr²): each point stands for 4πr² of it.
        of_place = 4.0 * dr.maximum(dr.dot(normal, direction), 0.0) if lamp.kind == "point" else falloff(lamp, direction)
        return mi.Ray3f(place, direction), of_place * (1.0 - least)

    return ray, 2.0 * math.pi * strength


def wide_disc(lamp, points):
    """Rays of a sun's disc: from each direction over the disc of the casters' ball."""
    middle, radius_m = ball_around(points)
    frame, middle = mi.Frame3f(vector(lamp.direction)), mi.Point3f(vector(middle))

    def ray(u, v, random):
        direction = in_cone(frame, math.cos(lamp.half_angle_rad), random.next_float32(), random.next_float32())
        across, place = mi.Frame3f(direction), radius_m * mi.warp.square_to_uniform_disk_concentric(mi.Point2f(u, v))
        return mi.Ray3f(middle + place.x * across.s + place.y * across.t - (radius_m + 1.0) * direction, direction), mi.Float(1.0)

    # E⊥ = πL sin²α over a solid angle of 2π(1 − cos α).
    return ray, lamp.amount * math.pi * radius_m**2 * 2.0 / (1.0 + math.cos(lamp.half_angle_rad))


def aim(lamp, points):
    """The rays of a lamp that may meet something specular."""
    if lamp.has_size:
        return (wide_disc if lamp.is_sun else wide_cone)(lamp, points)
    return (rectangle if lamp.is_sun else cone)(lamp, points)


class Surroundings:
    """What rays meet. Bodies are numbered from 1; 0 is air, and the index of a mirror."""

    def __init__(self, scene, is_beside, depth):
        with tempfile.TemporaryDirectory() as meshes:
            self.loaded = mi.load_dict({"type": "scene", "floor": mitsuba_scene.floor(mi, scene, 0.5),
                                        **mitsuba_scene.casters(scene, Path(meshes), [1.0, 1.0, 1.0])})
        by_name = {shape.id(): mi.ShapePtr(shape) for shape in self.loaded.shapes()}
        self.floor = by_name["floor"]
        self.bodies = [by_name[f"caster{number}"] for number in range(len(scene.casters))]
        self.ior = mi.Float([1.0] + [caster.ior or 0.0 for caster in scene.casters])
        alpha = [caster.roughness**2 if caster.roughness > SMOOTH else 0.0 for caster in scene.casters]
        self.alpha, self.is_rough = mi.Float([0.0] + alpha), any(alpha)
        self.is_nested = sum(caster.ior is not None for caster in scene.casters) > 1
        self.is_beside, self.depth, self.step_m = is_beside, depth, STEP * scene.side_m

    def body(self, hit):
        """The number of what was met."""
        found = mi.UInt32(0)
        for number, shape in enumerate(self.bodies, 1):
            found = dr.select(hit.shape == shape, mi.UInt32(number), found)
        return found

    def onwards(self, hit, direction):
        """A ray that goes on from a surface."""
        return hit.spawn_ray(direction) if self.is_beside else mi.Ray3f(hit.p + self.step_m * direction, direction)

    def cross(self, body, is_front, top, below):
        """Indices before and behind a surface, and the two innermost bodies behind it."""
        of_body, of_top = dr.gather(mi.Float, self.ior, body), dr.gather(mi.Float, self.ior, top)
        if not self.is_nested:
            return dr.select(is_front, 1.0, of_body), dr.select(is_front, of_body, 1.0), top, below
        is_top, is_below = ~is_front & (body == top), ~is_front & (body == below)
        near = dr.select(is_front | is_top | is_below, of_top, of_body)
        far = dr.select(is_front, of_body, dr.select(is_top, dr.gather(mi.Float, self.ior, below), of_top))
        return near, far, dr.select(is_front, body, dr.select(is_top, below, top)), dr.select(
            is_front, top, dr.select(is_top | is_below, mi.UInt32(0), below))


def refracted(direction, normal, eta):
    """Snell's law; along the surface where there is no way through."""
    cosine = -dr.dot(direction, normal)
    return dr.normalize(direction / eta + (cosine / eta - dr.safe_sqrt(1.0 - (1.0 - cosine**2) / eta**2)) * normal)


def mirrored(direction, normal):
    """The mirror image in the plane across a normal."""
    return direction - 2.0 * dr.dot(direction, normal) * normal


def micro_normal(normal, direction, alpha, random):
    """A visible GGX normal of a rough surface."""
    frame = mi.Frame3f(normal)
    lobe = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
    found, _ = lobe.sample(frame.to_local(-direction), mi.Point2f(random.next_float32(), random.next_float32()))
    return frame.to_world(found)


@dr.syntax
def land(around, ray, choice, random):
    """Follows rays over specular surfaces: where they end, and whether on the floor after at least one of them."""
    depth, going, landed = mi.UInt32(0), mi.Bool(True), mi.Bool(False)
    top, below = mi.UInt32(0), mi.UInt32(0)
    while going:
        # A path ends on the floor. It counts there if it met something specular before.
        hit = around.loaded.ray_intersect(ray, going)
        on_floor = hit.shape == around.floor
        landed = hit.is_valid() & on_floor & (depth > 0)
        going = hit.is_valid() & ~on_floor & (depth < around.depth)
        ray.maxt = dr.select(landed, hit.t, ray.maxt)

        # The interpolated normal counts on the side of the triangle that was met, unless it looks away from the ray.
        direction, body = ray.d, around.body(hit)
        is_front = dr.dot(direction, hit.n) < 0.0
        facet = dr.select(is_front, hit.n, -hit.n)
        normal = dr.select(dr.dot(hit.sh_frame.n, facet) < 0.0, -hit.sh_frame.n, hit.sh_frame.n)
        normal = dr.select(dr.dot(direction, normal) < 0.0, normal, facet)

        # Rough surfaces reflect and refract about a visible micro-normal.
        micro, alpha = normal, mi.Float(0.0)
        if around.is_rough:
            alpha = dr.gather(mi.Float, around.alpha, body)
            micro = dr.select(alpha > 0.0, micro_normal(normal, direction, alpha, random), normal)

        # Fresnel gives the probability of reflection, so that a path keeps all of its flux.
        near, far, inner, outer = around.cross(body, is_front, top, below)
        eta = dr.select(far > 0.0, far / near, 1.0)
        reflectance, _, _, _ = mi.fresnel(-dr.dot(direction, micro), eta)
        reflectance = dr.select(dr.gather(mi.Float, around.ior, body) == 0.0, 1.0, reflectance)
        is_reflected = choice < reflectance
        # What is left of the number serves for the next choice, with new last digits.
        probability = dr.select(is_reflected, reflectance, 1.0 - reflectance)
        choice = dr.select(is_reflected, choice, choice - reflectance) / probability
        choice = dr.minimum(choice + LAST_DIGIT / probability * random.next_float32(), 1.0 - LAST_DIGIT)
        back, through = mirrored(direction, micro), refracted(direction, micro, eta)
        if around.is_rough:
            # What a micro-facet sends to the wrong side of its surface.
            back = dr.select((alpha > 0.0) & (dr.dot(back, normal) < 0.0), mirrored(back, normal), back)
            through = dr.select((alpha > 0.0) & (dr.dot(through, normal) > 0.0), mirrored(through, normal), through)

        # Interpolated normals may send light to the wrong side of the triangle: then the triangle's own normal counts.
        back_by_facet = dr.select(alpha > 0.0, mirrored(back, facet), mirrored(direction, facet))
        back = dr.select(dr.dot(back, facet) > 0.0, back, back_by_facet)
        through_by_facet = dr.select(alpha > 0.0, mirrored(through, facet), refracted(direction, facet, eta))
        through = dr.select(dr.dot(through, facet) < 0.0, through, through_by_facet)

        # Only a ray that goes through the surface changes its medium.
        top, below = dr.select(is_reflected, top, inner), dr.select(is_reflected, below, outer)
        ray = dr.select(going, around.onwards(hit, dr.select(is_reflected, back, through)), ray)
        depth += 1
    return ray(ray.maxt), landed


def main():
    # Rays are aimed at the vertices of the casters: their bounds hold all that is specular.
    file, folder, budget_s, side, depth, samples, origins = sys.argv[1:]
    side = int(side)
    scene = scenes.read(file)
    if scene.is_dispersive:
        raise SystemExit("it has no wavelengths")
    points = numpy.vstack([caster.positions for caster in scene.casters])
    beams = [aim(lamp, points) for lamp in scene.lamps]
    around = Surroundings(scene, origins == "beside", int(depth))

    def hits(ray_of, cells, start, count, seed):
        """What lands on each texel of `count` rays, one in each cell from the cell `start` on."""
        # Each ray starts at a random place in its cell of the grid.
        random = mi.PCG32(count, initstate=seed)
        cell = dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, start)
        width = dr.opaque(mi.UInt32, cells)
        down, across = cell // width, cell % width
        u = (down + random.next_float32()) / mi.Float(width)
        v = (across + random.next_float32()) / mi.Float(width)

        # Choices between reflection and refraction are spread evenly among neighbours, another way for each seed.
        turn = down * EVEN_STEPS[0] + across * EVEN_STEPS[1] + dr.opaque(mi.UInt32, seed * HASH >> 8 & 0xFFFFFFFF)
        ray, share = ray_of(u, v, random)
        place, landed = land(around, ray, mi.Float(turn >> 8) * LAST_DIGIT, random)

        # A ray brings its share of the watts to the texel of the floor that it lands in.
        column = mi.Int32((place.x - scene.x0) * (side / scene.side_m))
        row = mi.Int32((place.z - scene.z0) * (side / scene.side_m))
        inside = landed & (place.x >= scene.x0) & (place.z >= scene.z0) & (column < side) & (row < side)
        found = dr.zeros(mi.Float, side * side)
        dr.scatter_add(found, share, mi.UInt32(row * side + column), inside)
        return found.numpy().astype(numpy.float64)

    def trace(thousands, seed):
        total, all_watts = numpy.zeros(side * side), sum(watts for _, watts in beams)

        # Lamps get rays by their watts, in a square number of cells, and passes that fit the memory.
        for number, (ray_of, watts) in enumerate(beams):
            cells = math.isqrt(max(int(1000 * thousands * watts / all_watts), 1))
            for start in range(0, cells * cells, LARGEST_PASS):
                seed_here = (seed << 32) + (number << 28) + start
                found = hits(ray_of, cells, start, min(LARGEST_PASS, cells * cells - start), seed_here)
                total += found * (watts / cells**2)
        return (total / (scene.side_m / side) ** 2).reshape(side, side)

    trace(100, 4095)  # compiles kernels, before the clock runs
    steps.take(folder, float(budget_s), FIRST_THOUSANDS, trace, pooled=False, rays_per_sample=1000, alike=int(samples))


main()
