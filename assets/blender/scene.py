"""The open scene as a GLB: what is seen, as renders take it, one Blender unit a metre."""

import contextlib
import json
import math
import os
import struct
import zlib
from pathlib import Path

import bpy
import numpy

from . import lamps
from .materials import Surface, nodes_of

UV_LAYER, BACK_UV_LAYER = "Nephroid", "Nephroid back"
# The modifier that shows a baked mesh.
BAKED_MESH = "Nephroid baked mesh"

# glTF's y is up.
TURN = numpy.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=numpy.float64)

COMPONENTS = {"f": 5126, "I": 5125}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


class Glb:
    """A glTF document and its binary chunk."""

    def __init__(self):
        self.binary = bytearray()
        self.used = set()
        self.document = {"asset": {"version": "2.0", "generator": "Nephroid for Blender"}, "scene": 0,
                         "scenes": [{"nodes": []}], "extensions": {}}

    def push(self, kind, entry):
        """Adds an entry to a list of the document; its index."""
        items = self.document.setdefault(kind, [])
        items.append(entry)
        return len(items) - 1

    def view(self, data):
        """Adds bytes; the index of their view."""
        self.binary.extend(b"\0" * (-len(self.binary) % 4))
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary.extend(data)
        return self.push("bufferViews", view)

    def accessor(self, values, bounds=False):
        """Adds an array of one row an element."""
        values = numpy.ascontiguousarray(values)
        width = values.shape[1] if values.ndim > 1 else 1
        entry = {"bufferView": self.view(values.tobytes()), "componentType": COMPONENTS[values.dtype.char],
                 "count": len(values), "type": SHAPES[width]}
        if bounds:
            entry.update(min=values.min(axis=0).tolist(), max=values.max(axis=0).tolist())
        return self.push("accessors", entry)

    def node(self, name, matrix, **entry):
        """Adds a node of the scene, placed by Blender's matrix. Lamps and cameras look along −z in both programs, and
        meshes are turned."""
        placed = TURN @ numpy.array(matrix, dtype=numpy.float64)
        if "mesh" in entry:
            placed = placed @ TURN.T
        index = self.push("nodes", {"name": name, "matrix": placed.T.ravel().tolist(), **entry})
        self.document["scenes"][0]["nodes"].append(index)
        return index

    def listed(self, extension, entry):
        """Adds a light to the list of an extension."""
        lights = self.document["extensions"].setdefault(extension, {"lights": []})["lights"]
        lights.append(entry)
        return len(lights) - 1

    def write(self, path):
        """Writes the file in one step, so that nobody reads half of it."""
        document = {key: value for key, value in self.document.items() if value}
        document["buffers"] = [{"byteLength": len(self.binary)}]
        used = self.used | set(document.get("extensions", {}))
        for material in document.get("materials", []):
            used |= set(material["extensions"])
        if used:
            document["extensionsUsed"] = sorted(used)
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        parts = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary))
        parts += struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
        half = Path(path).with_suffix(".part")
        half.write_bytes(parts)
        os.replace(half, path)


def read(collection, attribute, kind, width):
    """An attribute of every item of a Blender collection, one row each."""
    values = numpy.empty(len(collection) * width, dtype=kind)
    collection.foreach_get(attribute, values)
    return values.reshape(-1, width) if width > 1 else values


class Geometry:
    """An evaluated mesh, triangle by triangle."""

    def __init__(self, mesh):
        mesh.calc_loop_triangles()
        triangles = mesh.loop_triangles
        self.loops = read(triangles, "loops", "i", 3)
        self.slots = read(triangles, "material_index", "i", 1)
        self.positions = read(mesh.vertices, "co", "f", 3)
        self.vertices = read(mesh.loops, "vertex_index", "i", 1)
        self.loop_count = len(mesh.loops)
        # The program drops triangles without area; here they are not even counted.
        a, b, c = (self.positions[self.vertices[self.loops[:, corner]]].astype(numpy.float64) for corner in range(3))
        has_area = numpy.cross(b - a, c - a).any(axis=1)
        self.loops, self.slots = self.loops[has_area], self.slots[has_area]
        self.normals = read(mesh.corner_normals, "vector", "f", 3)
        self.uvs = {layer.name: read(layer.uv, "vector", "f", 2) for layer in mesh.uv_layers
                    if layer.name not in {UV_LAYER, BACK_UV_LAYER}}
        self.active_uv = next((layer.name for layer in mesh.uv_layers if layer.active_render and layer.name in self.uvs), None)

    def sets(self, wanted):
        """Names of the UV layers that are written: the one for renders, then one that a texture names, or the next."""
        names = [self.active_uv] if self.active_uv else []
        others = [name for name in self.uvs if name not in names]
        return (names + sorted(others, key=lambda name: name not in wanted))[:2]

    def primitive(self, glb, rows, sets):
        """Writes the triangles of a slot, with corners that agree as one vertex."""
        corners = self.loops[rows].ravel()
        columns = [self.positions[self.vertices[corners]], self.normals[corners]]
        columns = [numpy.stack([part[:, 0], part[:, 2], -part[:, 1]], axis=1) for part in columns]
        for name in sets:
            # glTF's v points down.
            columns.append(self.uvs[name][corners] * (1.0, -1.0) + (0.0, 1.0))
        table = numpy.ascontiguousarray(numpy.hstack(columns), dtype=numpy.float32) + 0.0
        _, first, index = numpy.unique(table.view(f"V{table.itemsize * table.shape[1]}"), return_index=True, return_inverse=True)
        table = table[first]
        attributes = {"POSITION": glb.accessor(table[:, :3], bounds=True), "NORMAL": glb.accessor(table[:, 3:6])}
        for number in range(len(sets)):
            start = 6 + 2 * number
            attributes[f"TEXCOORD_{number}"] = glb.accessor(table[:, start:start + 2])
        return {"attributes": attributes, "indices": glb.accessor(index.ravel().astype(numpy.uint32))}


class Part:
    """A node of the file and the object that it came from."""

    def __init__(self, name, is_instance, geometry, sets, primitives):
        self.object, self.is_instance, self.geometry = name, is_instance, geometry
        # Names of the UV layers in the file, and the material slot of each primitive.
        self.sets, self.primitives = sets, primitives


@contextlib.contextmanager
def as_rendered(objects):
    """Modifiers as renders have them, for as long as it takes."""
    kept = []

    def change(modifier, name, value):
        if getattr(modifier, name) != value:
            kept.append((modifier, name, getattr(modifier, name)))
            setattr(modifier, name, value)

    for item in objects:
        for modifier in item.modifiers:
            if item.library is None:
                is_ours = modifier.name.startswith(BAKED_MESH)
                change(modifier, "show_viewport", modifier.show_render and not is_ours)
                if hasattr(modifier, "render_levels"):
                    change(modifier, "levels", modifier.render_levels)
    try:
        yield
    finally:
        for modifier, name, value in reversed(kept):
            setattr(modifier, name, value)


class Export:
    """A scene written to a file, and what is needed to bring its maps back."""

    def __init__(self, context, path, settings):
        self.context, self.settings = context, settings
        self.glb, self.messages = Glb(), []
        # By index of the node.
        self.parts = {}
        self.materials, self.textures, self.images, self.meshes = {}, {}, {}, {}
        scene = context.scene
        objects = [item for item in scene.objects if item.type in GEOMETRY]
        with as_rendered(objects):
            depsgraph = context.evaluated_depsgraph_get()
            for instance in depsgraph.object_instances:
                self.add(instance)
        if scene.camera is not None and scene.camera.type == "CAMERA" and scene.camera.data.type == "PERSP":
            self.add_camera(scene)
        self.glb.write(path)

    def fault(self, owner):
        """A listener that notes what is lost of a named thing."""
        return lambda text: self.messages.append((owner, text)) if (owner, text) not in self.messages else None

    def is_wanted(self, item, owner, collection):
        return not item.hide_render and (collection is None or owner.name in collection.all_objects)

    def add(self, instance):
        """Adds what an entry of the dependency graph shows."""
        item = instance.object
        owner = (instance.parent if instance.is_instance else item).original
        if not (instance.show_self or instance.is_instance):
            return
        if item.type == "LIGHT":
            if self.is_wanted(item, owner, self.settings.lamps):
                self.add_lamp(item.original, instance.matrix_world, owner)
        elif item.type in GEOMETRY and self.is_wanted(item, owner, self.settings.objects):
            self.add_object(item, instance, owner)

    def add_lamp(self, item, matrix, owner):
        place, turn, scale = matrix.decompose()
        kind, entry, extras = lamps.gltf(item.data, scale, self.fault(owner.name))
        if kind is None:
            return
        node = {"extensions": {kind: {"light": self.glb.listed(kind, entry)}}}
        if extras:
            node["extras"] = extras
        rigid = turn.to_matrix().to_4x4()
        rigid.translation = place
        self.glb.node(owner.name, rigid, **node)

    def add_object(self, item, instance, owner):
        key = item.data.original if item.type == "MESH" and not item.modifiers else item.original
        slots = [slot.material.original if slot.material else None for slot in item.material_slots]
        known = self.meshes.get((key, tuple(slots)))
        if known is None:
            mesh = item.to_mesh()
            known = self.add_mesh(item, mesh, slots) if mesh is not None and len(mesh.polygons) else ()
            item.to_mesh_clear()
            self.meshes[key, tuple(slots)] = known
        if known:
            node = self.glb.node(owner.name, instance.matrix_world, mesh=known[0])
            self.parts[node] = Part(owner.name, instance.is_instance, *known[1:])

    def add_mesh(self, item, mesh, slots):
        """The index of a mesh, its geometry, its UV layers in the file, and the slot of each of its primitives."""
        geometry = Geometry(mesh)
        wanted = [name for slot in slots if slot for name in self.uv_names(slot)]
        sets = geometry.sets(wanted)
        primitives, kept = [], []
        last = max(len(slots) - 1, 0)
        geometry.slots = numpy.minimum(geometry.slots, last)
        for slot in numpy.unique(geometry.slots):
            rows = numpy.flatnonzero(geometry.slots == slot)
            primitive = geometry.primitive(self.glb, rows, sets)
            primitive["material"] = self.material(slots[slot] if slots else None, sets)
            primitives.append(primitive)
            kept.append(int(slot))
        return self.glb.push("meshes", {"name": item.name, "primitives": primitives}), geometry, sets, kept

    def uv_names(self, material):
        tree = nodes_of(material)
        return [node.uv_map for node in (tree.nodes if tree else ()) if node.type == "UVMAP"]

    def material(self, material, sets):
        """The index of a material whose textures follow these UV layers."""
        key = (material, tuple(sets))
        if key not in self.materials:
            if material is None:
                entry = {"name": "matte", "doubleSided": True, "extensions": {}, "pbrMetallicRoughness":
                         {"baseColorFactor": [0.8, 0.8, 0.8, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}}
            else:
                surface = Surface(material)
                entry = surface.gltf(lambda node: self.texture(node, sets, surface.fault))
                if surface.has_unread_colour and surface.is_matte() and self.settings.layers == "CAUSTIC":
                    # Its own nodes multiply the light map.
                    surface.faults = [text for text in surface.faults if "Color are not read" not in text]
                for text in surface.faults:
                    self.fault(("material", material.name_full))(text)
            self.materials[key] = self.glb.push("materials", entry)
        return self.materials[key]

    def texture(self, node, sets, fault):
        """The texture info of an Image Texture node."""
        info = {"index": self.image(node)}
        place = node.inputs["Vector"]
        mapping = None
        origin = place.links[0].from_node if place.is_linked else None
        if origin is not None and origin.type == "MAPPING":
            mapping = origin
            place = mapping.inputs["Vector"]
            origin = place.links[0].from_node if place.is_linked else None
        if origin is not None and origin.type == "UVMAP":
            if origin.uv_map in sets[1:]:
                info["texCoord"] = 1
        elif origin is not None and not (origin.type == "TEX_COORD" and place.links[0].from_socket.name == "UV"):
            fault(f"the coordinates of its image {node.image.name} are not read; its UV map was taken")
        if mapping is not None:
            shift, turn, scale = (mapping.inputs[name].default_value for name in ("Location", "Rotation", "Scale"))
            angle = turn[2]
            # The same transform with v pointing down.
            info["extensions"] = {"KHR_texture_transform": {
                "offset": [shift[0] - scale[1] * math.sin(angle), 1.0 - shift[1] - scale[1] * math.cos(angle)],
                "rotation": angle, "scale": [scale[0], scale[1]]}}
            self.glb.used.add("KHR_texture_transform")
        return info

    def image(self, node):
        """The index of a texture, its image stored as PNG or as the JPEG that it is."""
        image, wrap = node.image, {"EXTEND": 33071, "CLIP": 33071, "MIRROR": 33648}.get(node.extension, 10497)
        if (image, wrap) not in self.textures:
            if image not in self.images:
                data, kind = encoded(image)
                self.images[image] = self.glb.push("images", {"bufferView": self.glb.view(data), "mimeType": kind,
                                                              "name": image.name})
            sampler = self.glb.push("samplers", {"wrapS": wrap, "wrapT": wrap})
            self.textures[image, wrap] = self.glb.push("textures", {"source": self.images[image], "sampler": sampler})
        return self.textures[image, wrap]

    def add_camera(self, scene):
        camera, render = scene.camera.data, scene.render
        width = render.resolution_x * render.pixel_aspect_x
        height = render.resolution_y * render.pixel_aspect_y
        by_height = camera.sensor_fit == "VERTICAL" or (camera.sensor_fit == "AUTO" and height > width)
        angle = camera.angle if by_height else 2.0 * math.atan(math.tan(0.5 * camera.angle) * height / width)
        if camera.sensor_fit == "VERTICAL":
            angle = camera.angle_y
        lens = {"type": "perspective", "perspective": {"yfov": angle, "znear": camera.clip_start, "aspectRatio": width / height}}
        matrix = scene.camera.matrix_world.normalized()
        self.glb.node(scene.camera.name, matrix, camera=self.glb.push("cameras", lens))


def encoded(image):
    """Bytes and type of an image: its file where that is PNG or JPEG and unchanged, else a PNG of its pixels."""
    if image.source == "FILE" and not image.is_dirty:
        path = bpy.path.abspath(image.filepath, library=image.library)
        packed = image.packed_file
        data = packed.data if packed else Path(path).read_bytes() if os.path.isfile(path) else b""
        for start, kind in [(b"\x89PNG", "image/png"), (b"\xff\xd8\xff", "image/jpeg")]:
            if data.startswith(start):
                return data, kind
    width, height = image.size
    pixels = numpy.empty(len(image.pixels), dtype=numpy.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)
    if image.is_float:
        # Linear light, which a PNG of colours holds as sRGB.
        low, high = 12.92 * pixels, 1.055 * numpy.maximum(pixels, 0.0031308) ** (1.0 / 2.4) - 0.055
        pixels[..., :3] = numpy.where(pixels <= 0.0031308, low, high)[..., :3]
    return png(numpy.rint(numpy.clip(pixels[::-1], 0.0, 1.0) * 255.0).astype(numpy.uint8)), "image/png"


def png(pixels):
    """A PNG file of bytes [height, width, channels]."""
    height, width, channels = pixels.shape
    rows = numpy.zeros((height, 1 + width * channels), dtype=numpy.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
