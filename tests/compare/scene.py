"""What the compared programs need of a .glb file: its floor, what is specular, its lamps. Metres, y up, world coordinates."""

import json
import math
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
    roughness: float
    is_dispersive: bool


@dataclass
class Lamp:
    """What shines: `kind` is point, spot, directional or panel. Sizes are 0 where there is none.

    `amount` is radiant intensity [W/sr], on the axis of a spot; W/m² across the light of a sun; radiance [W/(m² sr)] of a panel.
    """

    kind: str
    position: numpy.ndarray  # [m], of a panel its middle
    direction: numpy.ndarray  # unit, where spots and panels look and a sun's light goes
    amount: float
    radius_m: float = 0.0  # of a ball, or of a spot's disc
    half_angle_rad: float = 0.0  # of a sun
    cone_rad: tuple[float, float] = (0.0, 0.0)  # of a spot: from its axis to where it begins to fade, and to its end
    half_axes_m: tuple = ()  # of a panel: from its middle to two of its sides

    @property
    def is_sun(self):
        """Whether its light comes from afar."""
        return self.kind == "directional"

    @property
    def has_size(self):
        """Whether its light comes from more than one place."""
        return self.radius_m > 0.0 or self.half_angle_rad > 0.0 or self.kind == "panel"


@dataclass
class Scene:
    """One horizontal floor, square, seen by its lamps by way of casters. Map row 0 lies at z0, column 0 at x0."""

    x0: float
    z0: float
    side_m: float
    height_m: float
    casters: list[Caster]
    lamps: list[Lamp]

    @property
    def lamp(self):
        """The only one."""
        (lamp,) = self.lamps
        return lamp

    @property
    def is_dispersive(self):
        """Whether wavelengths go different ways."""
        return any(caster.is_dispersive for caster in self.casters)


def read(path):
    """The scene in a .glb file."""
    document, binary = chunks(Path(path).read_bytes())
    casters, floor, lamps = [], None, []
    for node, world in nodes(document):
        if "mesh" in node:
            primitives = document["meshes"][node["mesh"]]["primitives"]
            if node.get("name") == "floor":
                floor = place(world, accessor(document, binary, primitives[0]["attributes"]["POSITION"]))
            else:
                casters += [caster(document, binary, primitive, world) for primitive in primitives]
        for name, on_node in node.get("extensions", {}).items():
            light = document["extensions"][name]["lights"][on_node["light"]]
            lamps.append((panel if name == "EXT_lights_area" else lamp_of)(light, world, node.get("extras", {})))
    if floor is None or not lamps or not casters:
        raise ValueError(f"{path}: a floor, a lamp and something specular are needed")
    low, high = floor.min(axis=0), floor.max(axis=0)
    return Scene(float(low[0]), float(low[2]), float(high[0] - low[0]), float(low[1]), casters, lamps)


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
        material.get("pbrMetallicRoughness", {}).get("roughnessFactor", 1.0),
        "KHR_materials_dispersion" in extensions,
    )


def axis(world, column):
    """A unit vector along an axis of a node."""
    return world[:3, column] / numpy.linalg.norm(world[:3, column])


def lamp_of(light, world, extras):
    """A punctual lamp in watts: candela and lux are lumens, of which 683 are a watt."""
    spot = light.get("spot", {})
    return Lamp(
        light["type"], world[:3, 3], -axis(world, 2), light.get("intensity", 1.0) / LUMENS_PER_WATT,
        extras.get("radius_m", 0.0), 0.5 * math.radians(extras.get("angular_diameter_deg", 0.0)),
        (spot.get("innerConeAngle", 0.0), spot.get("outerConeAngle", math.pi / 4)),
    )


def panel(light, world, _):
    """A rectangle of EXT_lights_area."""
    if light["type"] != "rect":
        raise ValueError("panels are rectangles here")
    half_m = 0.5 * light["size"] * max(numpy.linalg.norm(world[:3, :3], axis=0))
    sides = (half_m * light["rect"]["aspect"] * axis(world, 0), half_m * axis(world, 1))
    return Lamp("panel", world[:3, 3], -axis(world, 2), light["intensity"] / LUMENS_PER_WATT, half_axes_m=sides)
