"""Scenes of glass over a matte floor, written as .glb files: what the light pass is compared on.

Metres, y up. The floor is a square around the origin at y = 0, u along x and v along z; glass hangs or stands a little above it.
"""

import json
import math

import numpy

LUMENS_PER_WATT = 683.0
SMOOTH = 35.0  # degrees between faces up to which an edge is round
FLAT = 0.0


def lathe(profile, segments, crease_deg):
    """A closed body of revolution about y: a profile of (radius, height) from the axis to the axis, its inside to the left."""
    profile = numpy.array(profile, dtype=float)
    turn = 2.0 * math.pi * numpy.arange(segments) / segments
    rings = profile[:, None, 0, None] * numpy.stack([numpy.cos(turn), 0.0 * turn, numpy.sin(turn)], axis=1)
    rings[..., 1] = profile[:, 1, None]
    ring, place = numpy.meshgrid(numpy.arange(len(profile) - 1), numpy.arange(segments), indexing="ij")
    a, b = ring * segments + place, ring * segments + (place + 1) % segments
    corners = numpy.stack([a, a + segments, b + segments, a, b + segments, b], axis=-1).reshape(-1, 3)
    return smoothed(rings.reshape(-1, 3)[corners], crease_deg)


def curve(points, steps):
    """A Catmull-Rom curve through points, which are its ends as well."""
    points = numpy.array(points, dtype=float)
    padded = numpy.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    share = (numpy.arange(steps) / steps)[:, None]
    parts = []
    for p, a, b, q in zip(padded, padded[1:], padded[2:], padded[3:]):
        parts.append(a + 0.5 * share * (b - p + share * (2 * p - 5 * a + 4 * b - q + share * (3 * (a - b) + q - p))))
    return [*numpy.vstack(parts), points[-1]]


def ball(radius_m, middle, steps=64):
    """A ball, smooth."""
    turn = numpy.linspace(-0.5 * math.pi, 0.5 * math.pi, steps + 1)
    return moved(lathe(radius_m * numpy.stack([numpy.cos(turn).clip(1e-12), numpy.sin(turn)], axis=1), 2 * steps, 180.0), middle)


def cup(outer_m, inner_m, height_m, bottom_m, segments, crease_deg):
    """A beaker with straight walls and a thick bottom."""
    low = 0.002
    return lathe([(0, low), (outer_m, low), (outer_m, height_m), (inner_m, height_m), (inner_m, low + bottom_m),
                  (0, low + bottom_m)], segments, crease_deg)


def smoothed(triangles, crease_deg):
    """Triangles [n, 3, 3] with normals [n, 3, 3]: of all faces at a corner that turn by less than a crease, by area."""
    area = numpy.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = numpy.linalg.norm(area, axis=1)
    triangles, area, size = (each[size > 1e-16] for each in (triangles, area, size))
    unit = area / size[:, None]
    _, vertex = numpy.unique(numpy.round(triangles.reshape(-1, 3), 9), axis=0, return_inverse=True)
    vertex = vertex.ravel()
    order = numpy.argsort(vertex, kind="stable")
    first, count = numpy.searchsorted(vertex[order], vertex), numpy.bincount(vertex)[vertex]
    normals, face = numpy.zeros((len(vertex), 3)), numpy.arange(len(vertex)) // 3
    for step in range(count.max()):
        there = numpy.flatnonzero(step < count)
        other = face[order[first[there] + step]]
        is_round = (unit[face[there]] * unit[other]).sum(axis=1) >= math.cos(math.radians(crease_deg)) - 1e-9
        normals[there] += numpy.where(is_round[:, None], area[other], 0.0)
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    return triangles, normals.reshape(-1, 3, 3)


def turned(mesh, axis, degrees):
    """A mesh about an axis through the origin."""
    axis = numpy.array(axis, dtype=float) / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = math.radians(degrees)
    matrix = numpy.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return tuple(part @ matrix.T for part in mesh)


def moved(mesh, offset):
    """A mesh elsewhere."""
    return mesh[0] + numpy.array(offset, dtype=float), mesh[1]


def body(mesh, ior, **extensions):
    """Clear glass; `roughness` and KHR_materials_dispersion's `dispersion` may be given."""
    return {"mesh": mesh, "ior": ior, **extensions}


def lamp(kind, position, target, amount, **more):
    """A lamp that looks from a place to another, of so many watts per steradian, per m² (sun) or per m² and steradian (panel).

    Spots have `cone`, in degrees from the axis to where it is darker and to where it ends; `radius_m`, `angular_diameter_deg`
    and, of panels, `size_m` and `aspect` are sizes.
    """
    return {"kind": kind, "position": position, "target": target, "amount": amount, **more}


def goblet():
    foot = [(0, 0.002), (0.034, 0.002), (0.035, 0.004)]
    outside = curve([(0.035, 0.004), (0.012, 0.010), (0.005, 0.030), (0.006, 0.055), (0.028, 0.072), (0.038, 0.100), (0.036, 0.140)], 10)
    inside = curve([(0.0345, 0.1405), (0.0365, 0.100), (0.0265, 0.0735), (0.010, 0.066), (0, 0.0655)], 10)
    return [body(lathe(foot[:-1] + outside + inside, 128, SMOOTH), 1.5)], [
        lamp("spot", (0.35, 0.5, 0.15), (0, 0.07, 0), 0.6, cone=(14, 17))]


def bottle():
    outside = curve([(0.030, 0.005), (0.032, 0.02), (0.032, 0.085), (0.024, 0.110), (0.011, 0.130), (0.011, 0.165)], 8)
    inside = curve([(0.0085, 0.1652), (0.0085, 0.130), (0.0215, 0.108), (0.0292, 0.085), (0.0292, 0.02), (0.020, 0.010), (0, 0.012)], 8)
    bottom = [(0, 0.006), (0.024, 0.002)]
    return [body(lathe(bottom + outside + inside, 96, SMOOTH), 1.52)], [
        lamp("directional", (0.5, 0.7, 0.3), (0, 0, 0), 100.0, angular_diameter_deg=0.53)]


def stone(segments):
    """A cut stone, hung aslant."""
    profile = [(0, -0.0110), (0.0050, -0.0060), (0.0118, 0.0), (0.0120, 0.0006), (0.0100, 0.0030), (0.0065, 0.0048), (0, 0.0048)]
    return moved(turned(lathe(profile, segments, FLAT), (1, 0, 0.3), 17), (0, 0.022, 0))


def gem():
    return [body(stone(12), 2.42)], [lamp("point", (0.10, 0.25, 0.04), (0, 0, 0), 0.1)]


def block():
    prism = lathe([(0, -0.03), (0.022, -0.03), (0.028, -0.024), (0.028, 0.024), (0.022, 0.03), (0, 0.03)], 6, FLAT)
    return [body(moved(turned(prism, (1, 0.2, 0.5), 62), (0, 0.042, 0)), 1.62)], [
        lamp("panel", (0.18, 0.32, -0.12), (0, 0.04, 0), 60.0, size_m=0.04, aspect=1.5)]


def series():
    lower = [(0.035 * share, -0.008 + 0.006 * share**2) for share in numpy.linspace(0, 1, 24)]
    lens = lathe(lower + [(radius, -height) for radius, height in reversed(lower)], 96, SMOOTH)
    return [body(moved(turned(lens, (0, 0, 1), -20), (0.045, 0.125, 0)), 1.6), body(ball(0.025, (0, 0.045, 0)), 1.5)], [
        lamp("spot", (0.16, 0.42, 0), (0.045, 0.125, 0), 0.5, cone=(9, 12), radius_m=0.006)]


def drink():
    glass = body(cup(0.035, 0.031, 0.095, 0.009, 96, SMOOTH), 1.52)
    # It reaches a fifth of a millimetre into its glass.
    liquid = body(lathe([(0, 0.0108), (0.0312, 0.0108), (0.0312, 0.07), (0, 0.07)], 96, SMOOTH), 1.333)
    return [glass, liquid], [lamp("spot", (0.3, 0.36, 0.1), (0, 0.045, 0), 0.5, cone=(10, 13))]


def lamp_in_glass():
    egg = [(0.03 * math.sin(turn), 0.05 - 0.042 * math.cos(turn) + 0.006 * math.sin(turn) ** 2) for turn in numpy.linspace(0, math.pi, 65)]
    return [body(lathe(egg, 96, 180.0), 1.5)], [lamp("point", (0.007, 0.062, 0.004), (0, 0, 0), 0.08)]


def frosted():
    return [body(ball(0.03, (0, 0.04, 0)), 1.5, roughness=0.25)], [
        lamp("directional", (0.4, 0.8, -0.2), (0, 0, 0), 100.0, angular_diameter_deg=0.53)]


def dispersive():
    return [body(stone(8), 1.62, dispersion=0.8)], [lamp("spot", (-0.14, 0.30, 0.02), (0, 0.02, 0), 0.3, cone=(4, 5))]


def many_lamps():
    bowl = lathe([(0, 0.002), (0.02, 0.002)] + curve([(0.02, 0.002), (0.04, 0.02), (0.05, 0.045)], 10)
                 + curve([(0.0475, 0.0455), (0.0375, 0.023), (0.018, 0.008), (0, 0.007)], 10), 18, FLAT)
    around = [2.0 * math.pi * (number + 0.3) / 8 for number in range(8)]
    return [body(bowl, 1.54)], [
        lamp("spot", (0.3 * math.cos(turn), 0.25 + 0.02 * number, 0.3 * math.sin(turn)), (0, 0.02, 0), 0.05 + 0.02 * number, cone=(10, 14))
        for number, turn in enumerate(around)]


# By name: what makes bodies and lamps, and the floor's side [m].
SCENES = {
    "goblet": (goblet, 0.5), "bottle": (bottle, 0.4), "gem": (gem, 0.2), "block": (block, 0.3), "series": (series, 0.2),
    "drink": (drink, 0.4), "lamp_in_glass": (lamp_in_glass, 0.4), "frosted": (frosted, 0.2), "dispersive": (dispersive, 0.2),
    "many_lamps": (many_lamps, 0.4),
}


class File:
    """A .glb file in the making."""

    def __init__(self, document=None, binary=b""):
        self.binary, self.document = binary, document or {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [],
            "accessors": [], "bufferViews": [], "extensions": {},
        }

    def append(self, name, item):
        self.document[name].append(item)
        return len(self.document[name]) - 1

    def numbers(self, rows, kind):
        """An accessor of a list of numbers or vectors."""
        view = self.append("bufferViews", {"buffer": 0, "byteOffset": len(self.binary), "byteLength": rows.nbytes})
        self.binary += rows.tobytes()
        bounds = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()} if kind == "VEC3" else {}
        component = 5125 if rows.dtype == numpy.uint32 else 5126
        return self.append("accessors", {"bufferView": view, "componentType": component, "count": len(rows), "type": kind, **bounds})

    def node(self, **fields):
        self.document["scenes"][0]["nodes"].append(self.append("nodes", fields))

    def object(self, name, vertices, triangles, material):
        """A mesh of vertices with position, normal and perhaps texture coordinates."""
        vertices = vertices.astype(numpy.float32)
        names = [("POSITION", 0, 3, "VEC3"), ("NORMAL", 3, 6, "VEC3"), ("TEXCOORD_0", 6, 8, "VEC2")]
        attributes = {key: self.numbers(numpy.ascontiguousarray(vertices[:, start:end]), kind)
                      for key, start, end, kind in names if end <= vertices.shape[1]}
        primitive = {"attributes": attributes, "indices": self.numbers(triangles.astype(numpy.uint32).ravel(), "SCALAR"),
                     "material": self.append("materials", material)}
        self.node(name=name, mesh=self.append("meshes", {"primitives": [primitive]}))

    def light(self, extension, light, place, **extras):
        lights = self.document["extensions"].setdefault(extension, {"lights": []})["lights"]
        lights.append(light)
        self.node(extensions={extension: {"light": len(lights) - 1}}, extras=extras, **place)

    def write(self, path):
        used = {name for material in self.document["materials"] for name in material.get("extensions", {})}
        self.document["extensionsUsed"] = sorted(used | set(self.document["extensions"]))
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        parts = [(b"JSON", text), (b"BIN\0", self.binary)]
        chunks = b"".join(len(data).to_bytes(4, "little") + kind + data for kind, data in parts)
        path.write_bytes(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)


def looking(position, target):
    """Translation and rotation of a node at a place whose −z looks at another."""
    position, target = numpy.array(position, dtype=float), numpy.array(target, dtype=float)
    forward = (target - position) / max(numpy.linalg.norm(target - position), 1e-9)
    # The half-way quaternion from −z.
    quaternion = numpy.array([*numpy.cross([0, 0, -1], forward), 1.0 - forward[2]])
    return {"translation": position.tolist(), "rotation": (quaternion / numpy.linalg.norm(quaternion)).tolist()}


def add_lamp(file, lamp):
    """KHR_lights_punctual, or EXT_lights_area of a panel."""
    place, intensity = looking(lamp["position"], lamp["target"]), LUMENS_PER_WATT * lamp["amount"]
    if lamp["kind"] == "panel":
        light = {"type": "rect", "intensity": intensity, "size": lamp["size_m"], "rect": {"aspect": lamp["aspect"]}}
        return file.light("EXT_lights_area", light, place)
    light = {"type": lamp["kind"], "intensity": intensity}
    if "cone" in lamp:
        inner, outer = map(math.radians, lamp["cone"])
        light["spot"] = {"innerConeAngle": inner, "outerConeAngle": outer}
    extras = {name: lamp[name] for name in ["radius_m", "angular_diameter_deg"] if name in lamp}
    return file.light("KHR_lights_punctual", light, place, **extras)


def write(name, folder):
    """A scene as a file."""
    (make, side_m), file = SCENES[name], File()
    u, v = numpy.array([0, 1, 1, 0]), numpy.array([0, 0, 1, 1])
    floor = numpy.stack([side_m * (u - 0.5), 0 * u, side_m * (v - 0.5), 0 * u, 0 * u + 1, 0 * u, u, v], axis=1)
    file.object("floor", floor, numpy.array([[0, 2, 1], [0, 3, 2]]), {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}})
    bodies, lamps = make()
    for number, found in enumerate(bodies):
        extensions = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1},
                      "KHR_materials_ior": {"ior": found["ior"]}}
        if "dispersion" in found:
            extensions["KHR_materials_dispersion"] = {"dispersion": found["dispersion"]}
        corners = numpy.concatenate(found["mesh"], axis=2).reshape(-1, 6)
        vertices, triangles = numpy.unique(numpy.round(corners, 9), axis=0, return_inverse=True)
        material = {"metallicFactor": 0, "roughnessFactor": found.get("roughness", 0)}
        file.object(f"glass{number}", vertices, triangles.reshape(-1, 3), {"pbrMetallicRoughness": material, "extensions": extensions})
    for each in lamps:
        add_lamp(file, each)
    path = folder / f"{name}.glb"
    file.write(path)
    return path
