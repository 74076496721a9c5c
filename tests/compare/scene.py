"""What the compared programs need of a .glb file: its floor, what is specular, its lamp. Metres, y up, world coordinates."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy

LUMENS_PER_WATT = 683.0
COMPONENTS = {5121: numpy.uint8, 5123: numpy.uint16, 5125: numpy.uint32, 5126: numpy.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


@dataclass
class Caster:
    """A specular mesh: positions [m] and unit normals, both [n, 3]; triangles [m, 3], counter-clockwise from outside."""

    positions: numpy.ndarray
    normals: numpy.ndarray
    triangles: numpy.ndarray
    ior: float | None  # of a dielectric; None is a mirror that reflects everything


@dataclass
class Lamp:
    """A point light at `position` [m] of radiant intensity `amount` [W/sr], or a sun towards `direction` of `amount` W/m²."""

    is_sun: bool
    position: numpy.ndarray
    direction: numpy.ndarray
    amount: float


@dataclass
class Scene:
    """One horizontal floor, square, seen by its lamp by way of casters. Map row 0 lies at z0, column 0 at x0."""

    x0: float
    z0: float
    side_m: float
    height_m: float
    casters: list[Caster]
    lamp: Lamp


def read(path):
    """The scene in a .glb file."""
    document, binary = chunks(Path(path).read_bytes())
    casters, floor, lamp = [], None, None
    for node, world in nodes(document):
        if "mesh" in node:
            primitives = document["meshes"][node["mesh"]]["primitives"]
            if node.get("name") == "floor":
                floor = place(world, accessor(document, binary, primitives[0]["attributes"]["POSITION"]))
            else:
                casters += [caster(document, binary, primitive, world) for primitive in primitives]
        light = node.get("extensions", {}).get("KHR_lights_punctual")
        if light:
            lamp = lamp_of(document["extensions"]["KHR_lights_punctual"]["lights"][light["light"]], world)
    if floor is None or lamp is None or not casters:
        raise ValueError(f"{path}: a floor, a lamp and something specular are needed")
    low, high = floor.min(axis=0), floor.max(axis=0)
    return Scene(float(low[0]), float(low[2]), float(high[0] - low[0]), float(low[1]), casters, lamp)


def ior_above_floor(scene):
    """The refractive index of what lies on the floor: of a dielectric whose surface is crossed an odd number of times straight
    up from a place near the floor's middle (not in it, where vertices may be), or 1 of air."""
    place = numpy.array([scene.x0, scene.z0]) + scene.side_m * numpy.array([0.4872931, 0.5107653])
    for caster in scene.casters:
        corners = caster.positions[caster.triangles][:, :, [0, 2]] - place
        after = numpy.roll(corners, -1, axis=1)
        turns = corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]
        crossings = int(((turns > 0).all(axis=1) | (turns < 0).all(axis=1)).sum())
        if caster.ior and crossings % 2:
            return caster.ior
    return 1.0


def chunks(data):
    """The JSON and the binary chunk of a .glb."""
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20:20 + length]), data[28 + length:]


def nodes(document):
    """Every node of the scene with its world_from_object, 4 × 4."""
    waiting = [(index, numpy.eye(4)) for index in document["scenes"][document.get("scene", 0)]["nodes"]]
    while waiting:
        index, parent = waiting.pop(0)
        node = document["nodes"][index]
        world = parent @ local(node)
        waiting += [(child, world) for child in node.get("children", [])]
        yield node, world


def local(node):
    """parent_from_object of a node, 4 × 4."""
    if "matrix" in node:
        return numpy.array(node["matrix"]).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    turn = numpy.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    matrix = numpy.eye(4)
    matrix[:3, :3] = turn * numpy.array(node.get("scale", [1, 1, 1]))
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def accessor(document, binary, index):
    """The numbers of an accessor, [count, width]."""
    entry = document["accessors"][index]
    view = document["bufferViews"][entry["bufferView"]]
    kind, width = numpy.dtype(COMPONENTS[entry["componentType"]]), WIDTHS[entry["type"]]
    start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    stride = view.get("byteStride", kind.itemsize * width)
    return numpy.ndarray((entry["count"], width), kind, binary, start, (stride, kind.itemsize)).copy()


def place(world, positions):
    """Positions in world coordinates [m]."""
    return positions @ world[:3, :3].T + world[:3, 3]


def caster(document, binary, primitive, world):
    """A specular mesh and what it is made of."""
    attributes = primitive["attributes"]
    normals = accessor(document, binary, attributes["NORMAL"]) @ numpy.linalg.inv(world[:3, :3])
    material = document["materials"][primitive["material"]]
    extensions = material.get("extensions", {})
    is_mirror = "KHR_materials_transmission" not in extensions
    return Caster(
        place(world, accessor(document, binary, attributes["POSITION"])),
        normals / numpy.linalg.norm(normals, axis=1, keepdims=True),
        accessor(document, binary, primitive["indices"]).reshape(-1, 3),
        None if is_mirror else extensions.get("KHR_materials_ior", {}).get("ior", 1.5),
    )


def lamp_of(light, world):
    """A lamp in watts: candela and lux are lumens, of which 683 are a watt."""
    direction = -world[:3, 2]
    return Lamp(
        light["type"] == "directional",
        world[:3, 3],
        direction / numpy.linalg.norm(direction),
        light.get("intensity", 1.0) / LUMENS_PER_WATT,
    )
