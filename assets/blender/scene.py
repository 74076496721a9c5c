"""The open scene as a GLB: what is seen, as renders take it, one Blender unit a metre."""

import contextlib
import json
import math
import os
import struct
from collections import namedtuple
from pathlib import Path

import bpy
import numpy

from . import lamps
from .materials import Surface, source

UV_LAYER, BACK_UV_LAYER = "Nephroid", "Nephroid back"
# The modifier that shows a baked mesh.
BAKED_MESH = "Nephroid baked mesh"

# glTF's y is up.
TURN = numpy.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=numpy.float64)

COMPONENTS = {"f": 5126, "I": 5125}
SHAPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3"}
WRAPS = {"EXTEND": 33071, "CLIP": 33071, "MIRROR": 33648, "REPEAT": 10497}
GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "META"}

# What a node of the file shows: the name of the object that it comes from, whether that is an instance, its Geometry.
Part = namedtuple("Part", "object is_instance geometry")


class Glb:
    """A glTF document and its binary chunk."""

    def __init__(self):
        # `used` names extensions.
        self.binary, self.used = bytearray(), set()
        self.document = {"asset": {"version": "2.0", "generator": "Nephroid for Blender"},
                         "scenes": [{"nodes": []}], "extensions": {}}

    def push(self, kind, entry, extension=None):
        """Adds an entry to a list of the document or of one of its extensions; its index."""
        owner = self.document["extensions"].setdefault(extension, {}) if extension else self.document
        items = owner.setdefault(kind, [])
        items.append(entry)
        return len(items) - 1

    def view(self, data):
        """Adds bytes, aligned to 4; the index of their view."""
        start = len(self.binary)
        self.binary.extend(data + bytes(-len(data) % 4))
        return self.push("bufferViews", {"buffer": 0, "byteOffset": start, "byteLength": len(data)})

    def accessor(self, values, **bounds):
        """Adds an array of one row an element."""
        return self.push("accessors", {
            "bufferView": self.view(values.tobytes()), "count": len(values), "type": SHAPES[values.shape[1:]],
            "componentType": COMPONENTS[values.dtype.char], **bounds})

    def node(self, name, matrix, **entry):
        """Adds a node, placed by Blender's matrix. Meshes are turned; lamps and cameras look along −z in glTF, too."""
        placed = TURN @ numpy.array(matrix, dtype=numpy.float64)
        if "mesh" in entry:
            placed = placed @ TURN.T
        index = self.push("nodes", {"name": name, "matrix": placed.T.ravel().tolist(), **entry})
        self.document["scenes"][0]["nodes"].append(index)
        return index

    def write(self, path):
        """Writes the file in one step, so that nobody reads half of it."""
        document = dict(self.document, buffers=[{"byteLength": len(self.binary)}], extensionsUsed=sorted(self.used))
        text = json.dumps({key: value for key, value in document.items() if value}).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(self.binary), len(text), 0x4E4F534A)
        half = path.with_suffix(".part")
        half.write_bytes(head + text + struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary)
        os.replace(half, path)


def read(collection, attribute, kind, width):
    """An attribute of every item of a Blender collection, one row each."""
    values = numpy.empty(len(collection) * width, dtype=kind)
    collection.foreach_get(attribute, values)
    return values.reshape(-1, width) if width > 1 else values


class Geometry:
    """An evaluated mesh, triangle by triangle."""

    def __init__(self, mesh, materials):
        mesh.calc_loop_triangles()
        self.loops = read(mesh.loop_triangles, "loops", "i", 3)
        self.slots = numpy.minimum(read(mesh.loop_triangles, "material_index", "i", 1), len(materials) - 1)
        self.positions = read(mesh.vertices, "co", "f", 3)
        self.vertices = read(mesh.loops, "vertex_index", "i", 1)
        # The program drops triangles without area; here they are not even counted.
        a, b, c = (self.positions[self.vertices[self.loops[:, corner]]].astype(numpy.float64) for corner in range(3))
        has_area = numpy.cross(b - a, c - a).any(axis=1)
        self.loops, self.slots = self.loops[has_area], self.slots[has_area]
        # Of each primitive.
        self.filled_slots = numpy.unique(self.slots).tolist()
        self.normals = read(mesh.corner_normals, "vector", "f", 3)
        layers = [layer for layer in mesh.uv_layers if layer.name not in {UV_LAYER, BACK_UV_LAYER}]
        self.uvs = {layer.name: read(layer.uv, "vector", "f", 2) for layer in layers}
        self.active_uv = next((layer.name for layer in layers if layer.active_render), None)
        trees = [material.node_tree for material in materials if material and material.node_tree]
        named = {node.uv_map for tree in trees for node in tree.nodes if node.type == "UVMAP"}
        # In the file: the UV layer for renders, then one that a texture names, or the next.
        self.sets = sorted(self.uvs, key=lambda name: (name != self.active_uv, name not in named))[:2]

    def primitive(self, glb, slot, material):
        """Writes the triangles of a slot, with corners that agree as one vertex."""
        corners = self.loops[self.slots == slot].ravel()
        columns = [part @ TURN[:3, :3].T for part in (self.positions[self.vertices[corners]], self.normals[corners])]
        # glTF's v points down.
        columns += [self.uvs[name][corners] * (1.0, -1.0) + (0.0, 1.0) for name in self.sets]
        # Zeros lose their signs, so that equal rows have equal bytes.
        table = numpy.ascontiguousarray(numpy.hstack(columns), dtype=numpy.float32) + 0.0
        _, first, index = numpy.unique(table.view(f"V{4 * table.shape[1]}"), return_index=True, return_inverse=True)
        position, normal, *uvs = numpy.split(table[first], [3, 6, 8], axis=1)
        bounds = {"min": position.min(axis=0).tolist(), "max": position.max(axis=0).tolist()}
        attributes = {"POSITION": glb.accessor(position, **bounds), "NORMAL": glb.accessor(normal)}
        attributes.update((f"TEXCOORD_{number}", glb.accessor(uvs[number])) for number in range(len(self.sets)))
        indices = glb.accessor(index.ravel().astype(numpy.uint32))
        return {"attributes": attributes, "indices": indices, "material": material}


@contextlib.contextmanager
def as_rendered(objects):
    """Modifiers as renders have them, for as long as it takes."""
    kept = []
    for modifier in [modifier for item in objects if item.library is None for modifier in item.modifiers]:
        wanted = {"show_viewport": modifier.show_render and not modifier.name.startswith(BAKED_MESH)}
        if hasattr(modifier, "render_levels"):
            wanted["levels"] = modifier.render_levels
        for name, value in wanted.items():
            if getattr(modifier, name) != value:
                kept.append((modifier, name, getattr(modifier, name)))
                setattr(modifier, name, value)
    try:
        yield
    finally:
        for modifier, name, value in kept:
            setattr(modifier, name, value)


class Export:
    """A scene written to a file, and what is needed to bring its maps back."""

    def __init__(self, context, path):
        scene, self.glb = context.scene, Glb()
        self.settings = scene.nephroid
        # What is lost, as (owner, text) with the owner as (kind, name); and a Part by index of its node.
        self.messages, self.parts = [], {}
        self.materials, self.textures, self.images, self.meshes = {}, {}, {}, {}
        with as_rendered([item for item in scene.objects if item.type in GEOMETRY]):
            for instance in context.evaluated_depsgraph_get().object_instances:
                self.add(instance)
        if scene.camera is not None and scene.camera.type == "CAMERA" and scene.camera.data.type == "PERSP":
            self.add_camera(scene)
        self.glb.write(path)

    def fault(self, *owner):
        """A listener that notes what is lost of a named thing."""
        return lambda text: self.messages.append((owner, text)) if (owner, text) not in self.messages else None

    def add(self, instance):
        """Adds what an entry of the dependency graph shows."""
        item = instance.object
        owner = (instance.parent if instance.is_instance else item).original
        collection = self.settings.lamps if item.type == "LIGHT" else self.settings.objects
        if not (instance.show_self or instance.is_instance) or item.hide_render or (
                collection is not None and owner.name not in collection.all_objects):
            return
        if item.type == "LIGHT":
            self.add_lamp(item.original, instance.matrix_world, owner)
        elif item.type in GEOMETRY:
            self.add_object(item, instance, owner)

    def add_lamp(self, item, matrix, owner):
        place, turn, scale = matrix.decompose()
        kind, entry, extras = lamps.gltf(item.data, scale, self.fault("node", owner.name))
        if kind is not None:
            rigid = turn.to_matrix().to_4x4()
            rigid.translation = place
            self.glb.used.add(kind)
            light = self.glb.push("lights", entry, extension=kind)
            self.glb.node(owner.name, rigid, extensions={kind: {"light": light}}, extras=extras)

    def add_object(self, item, instance, owner):
        materials = tuple(slot.material.original if slot.material else None for slot in item.material_slots) or (None,)
        key = item.data.original if item.type == "MESH" and not item.modifiers else item.original, materials
        if key not in self.meshes:
            mesh, self.meshes[key] = item.to_mesh(), None
            if mesh and mesh.polygons:
                geometry = Geometry(mesh, materials)
                primitives = [geometry.primitive(self.glb, slot, self.material(materials[slot], geometry.sets))
                              for slot in geometry.filled_slots]
                self.meshes[key] = self.glb.push("meshes", {"name": item.name, "primitives": primitives}), geometry
            item.to_mesh_clear()
        if self.meshes[key]:
            index, geometry = self.meshes[key]
            node = self.glb.node(owner.name, instance.matrix_world, mesh=index)
            self.parts[node] = Part(owner.name, instance.is_instance, geometry)

    def material(self, material, sets):
        """The index of a material whose textures follow these UV layers."""
        key = material, tuple(sets)
        if key not in self.materials:
            if material is None:
                entry = {"name": "matte", "doubleSided": True, "extensions": {}, "pbrMetallicRoughness":
                         {"baseColorFactor": [0.8, 0.8, 0.8, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}}
            else:
                surface = Surface(material)
                entry = surface.gltf(lambda node: self.texture(node, sets, surface.fault))
                # Where nothing but light maps shows a colour, its own nodes multiply them.
                shown = surface.colour_fault if surface.is_matte() and self.settings.layers == "CAUSTIC" else None
                for text in surface.faults:
                    if text != shown:
                        self.fault("material", material.name_full)(text)
            self.glb.used.update(entry["extensions"])
            self.materials[key] = self.glb.push("materials", entry)
        return self.materials[key]

    def texture(self, node, sets, fault):
        """The texture info of an Image Texture node."""
        info = {"index": self.image(node)}
        origin, socket = source(node.inputs["Vector"])
        if origin is not None and origin.type == "MAPPING":
            shift, turn, scale = (origin.inputs[name].default_value for name in ("Location", "Rotation", "Scale"))
            # The same transform with v pointing down.
            info["extensions"] = {"KHR_texture_transform": {
                "offset": [shift[0] - scale[1] * math.sin(turn[2]), 1.0 - shift[1] - scale[1] * math.cos(turn[2])],
                "rotation": turn[2], "scale": [scale[0], scale[1]]}}
            self.glb.used.add("KHR_texture_transform")
            origin, socket = source(origin.inputs["Vector"])
        if origin is not None and origin.type == "UVMAP":
            info["texCoord"] = int(origin.uv_map in sets[1:])
        elif origin is not None and not (origin.type == "TEX_COORD" and socket.name == "UV"):
            fault(f"the coordinates of its image {node.image.name} are not read; its UV map was taken")
        return info

    def image(self, node):
        """The index of a texture, its image stored as PNG or as the JPEG that it is."""
        image, wrap = node.image, WRAPS[node.extension]
        if (image, wrap) not in self.textures:
            if image not in self.images:
                data, kind = encoded(image)
                self.images[image] = self.glb.push("images", {"bufferView": self.glb.view(data), "mimeType": kind,
                                                              "name": image.name})
            sampler = self.glb.push("samplers", {"wrapS": wrap, "wrapT": wrap})
            self.textures[image, wrap] = self.glb.push("textures", {"source": self.images[image], "sampler": sampler})
        return self.textures[image, wrap]

    def add_camera(self, scene):
        # Of the corners of its frame, in its own coordinates [m].
        xs, ys, zs = zip(*scene.camera.data.view_frame(scene=scene))
        height, depth = max(ys) - min(ys), -zs[0]
        lens = {"type": "perspective", "perspective": {
            "yfov": 2.0 * math.atan(0.5 * height / depth), "aspectRatio": (max(xs) - min(xs)) / height,
            "znear": scene.camera.data.clip_start}}
        self.glb.node(scene.camera.name, scene.camera.matrix_world.normalized(), camera=self.glb.push("cameras", lens))


def encoded(image):
    """Bytes and type of an image: its file where that is PNG or JPEG and unchanged, else a PNG of its pixels."""
    if image.source == "FILE" and not image.is_dirty:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        data = image.packed_file.data if image.packed_file else path.read_bytes() if path.is_file() else b""
        for start, kind in [(b"\x89PNG", "image/png"), (b"\xff\xd8\xff", "image/jpeg")]:
            if data.startswith(start):
                return data, kind
    # Saving the image itself would change where the file says it comes from.
    path = Path(bpy.app.tempdir) / "nephroid.png"
    copy = bpy.data.images.new("nephroid", *image.size, alpha=True, float_buffer=image.is_float)
    try:
        copy.colorspace_settings.name = image.colorspace_settings.name
        texels = numpy.array(image.pixels[:], numpy.float32).reshape(-1, image.channels)
        rgba = numpy.ones((len(texels), 4), numpy.float32)
        rgba[:, :max(3, image.channels)] = texels
        copy.pixels.foreach_set(rgba.ravel())
        copy.filepath_raw, copy.file_format = str(path), "PNG"
        copy.save()
    finally:
        bpy.data.images.remove(copy)
    return path.read_bytes(), "image/png"
