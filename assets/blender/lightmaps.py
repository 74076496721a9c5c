"""Light maps in Blender: images, coordinates and nodes that add their light, and how to take all of it away again.

One tiled image holds the maps of all surfaces; its first tile is black, for surfaces without one. A material gets one
group node before its output. Coordinates lie in a UV layer of their own: of the mesh, where that is what was baked,
else of a copy of the baked mesh, which a modifier shows in its place.
"""

import json

import bpy
import numpy

from .materials import LIGHT_MAP_GROUP, Surface, output
from .scene import BACK_UV_LAYER, BAKED_MESH, UV_LAYER

IMAGE, MATTE = "Nephroid light", "Nephroid matte"
FIRST_TILE, MOST_TILES = 1001, 999
CAUSTICS, CAUSTIC_FLAGS = "nephroid_caustics", ("caustics_reflective", "caustics_refractive")
# Keeps coordinates off the borders of their tile.
INSET = 1e-5


def is_ours(block, name):
    """Whether a data-block is ours: Blender numbers names that are taken."""
    return block.name == name or block.name.startswith(name + ".")


def put_back(context, export, folder, keeps_lamps, fault):
    """Shows the exported textures in `folder` on the surfaces of the scene; how many have one.

    `fault(object name, text)` is told of surfaces that cannot show theirs.
    """
    # What an earlier bake added goes first: a surface shows one light map.
    remove(context)

    # Each texture becomes a tile, to which the coordinates of its surface and side are moved.
    shown, files = {}, []
    for texture in json.loads((folder / "textures" / "index.json").read_text())["textures"]:
        place, = texture["maps"]
        part = export.parts[place["node"]]
        why = unusable(bpy.data.objects.get(part.object), part)
        if why or len(files) == MOST_TILES:
            fault(part.object, why or "there are too many maps; its was left out")
            continue
        files.append(folder / "textures" / texture["file"])
        _, sides = shown.setdefault(part.object, (part, {}))
        uvs = sides.setdefault(place["side"], numpy.zeros((len(part.geometry.loops), 3, 2)))
        write_tile(uvs, part, place, folder, len(files))
    if not shown:
        return 0

    # All materials share one node group, and each gets one node of it, however many objects have the material.
    group = light_map_group(load_tiles(files, folder), keeps_lamps)
    lost = {}
    for name, (part, sides) in shown.items():
        item = bpy.data.objects[name]
        give_material(item)
        write_layers(item, part.geometry, sides)
        for material in {slot.material for slot in item.material_slots if slot.material}:
            if material not in lost:
                lost[material] = add_node(material, group)
            if lost[material]:
                fault(name, lost[material])

    if hasattr(context.scene, "cycles"):
        # Cycles' own caustics would be there twice.
        context.scene[CAUSTICS] = [int(getattr(context.scene.cycles, name)) for name in CAUSTIC_FLAGS]
        for name in CAUSTIC_FLAGS:
            setattr(context.scene.cycles, name, False)
    return len(files)


def unusable(item, part):
    """Why an object cannot show a map; None where it can."""
    if item is None:
        return "was removed or renamed while its light map was baked"
    if part.is_instance:
        return "is an instance, which cannot have a light map of its own; make instances real to give it one"
    if item.library is not None or (item.data and item.data.library is not None):
        return "is linked from another file and cannot be changed; make it local to give it a light map"
    return None


def write_tile(uvs, part, place, folder, tile):
    """Writes the coordinates of a map, moved to its tile, into those of its object."""
    geometry = part.geometry
    rows = numpy.flatnonzero(geometry.slots == geometry.filled_slots[place["primitive"]])
    if place["uv_file"]:
        data = (folder / "textures" / place["uv_file"]).read_bytes()
        own = numpy.frombuffer(data, dtype="<f8", offset=16).reshape(-1, 3, 2) * (1.0, -1.0) + (0.0, 1.0)
    else:
        own = geometry.uvs[geometry.sets[int(place["uv_set"][-1])]][geometry.loops[rows]]
    if len(own) != len(rows):
        raise ValueError(f"the light map of {part.object} has {len(own)} triangles instead of {len(rows)}; bake again")
    uvs[rows] = numpy.clip(own, INSET, 1.0 - INSET) + (tile % 10, tile // 10)


def load_tiles(files, folder):
    """One image of a tile a file, packed into the .blend, after a black one."""
    image = bpy.data.images.new(IMAGE, 1, 1, float_buffer=True, tiled=True)
    image.file_format = "OPEN_EXR"
    image.filepath_raw = str(folder / "light.<UDIM>.exr")
    image.save()
    for number, file in enumerate(files, FIRST_TILE + 1):
        file.rename(folder / f"light.{number}.exr")
        image.tiles.new(number)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pack()
    return image


def node_group(name, kind, sockets, nodes, links):
    """A node group of sockets (name, direction, type), nodes {key: (type, values)}, links (key, output, key, input)."""
    tree = bpy.data.node_groups.new(name, kind)
    for socket, way, what in sockets:
        tree.interface.new_socket(socket, in_out=way, socket_type=f"NodeSocket{what}")
    made = {}
    for key, (what, values) in nodes.items():
        made[key] = tree.nodes.new(what)
        made[key].location.x = 200.0 * len(made)
        for attribute, value in values.items():
            setattr(made[key], attribute, value)
    for start, origin, end, target in links:
        tree.links.new(made[start].outputs[origin], made[end].inputs[target])
    return tree


def light_map_group(image, keeps_lamps):
    """Adds albedo · E/π to a shader, or shows nothing else."""
    sockets = [("Shader", "INPUT", "Shader"), ("Color", "INPUT", "Color"), ("Strength", "INPUT", "Float"),
               ("Shader", "OUTPUT", "Shader")]
    nodes = {
        "given": ("NodeGroupInput", {}), "front": ("ShaderNodeUVMap", {"uv_map": UV_LAYER}),
        "back": ("ShaderNodeUVMap", {"uv_map": BACK_UV_LAYER}), "side": ("ShaderNodeNewGeometry", {}),
        "place": ("ShaderNodeMix", {"data_type": "VECTOR"}),
        "light": ("ShaderNodeTexImage", {"image": image, "extension": "EXTEND"}),
        "product": ("ShaderNodeVectorMath", {"operation": "MULTIPLY"}), "glow": ("ShaderNodeEmission", {}),
        "sum": ("ShaderNodeAddShader", {}), "result": ("NodeGroupOutput", {})}
    links = [
        ("side", "Backfacing", "place", "Factor"), ("front", "UV", "place", "A"), ("back", "UV", "place", "B"),
        ("place", "Result", "light", "Vector"), ("light", "Color", "product", 0), ("given", "Color", "product", 1),
        ("product", "Vector", "glow", "Color"), ("given", "Strength", "glow", "Strength"),
        ("glow", "Emission", "sum", 1), ("sum", "Shader", "result", "Shader")]
    if keeps_lamps:
        links.append(("given", "Shader", "sum", 0))
    return node_group(LIGHT_MAP_GROUP, "ShaderNodeTree", sockets, nodes, links)


def add_node(material, group):
    """Puts the group before a material's output; why that is impossible, or None."""
    if material.library is not None:
        return f"its material {material.name} is linked from another file; make it local to show its light map"
    end = output(material)
    if end is None or not end.inputs["Surface"].is_linked:
        return f"its material {material.name} uses no nodes; turn on Use Nodes to show its light map"
    surface = Surface(material)
    tree, link = material.node_tree, material.node_tree.links.new
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.label, node.location = LIGHT_MAP_GROUP, (end.location[0], end.location[1] + 220)
    link(end.inputs["Surface"].links[0].from_socket, node.inputs["Shader"])
    link(node.outputs["Shader"], end.inputs["Surface"])
    node.inputs["Color"].default_value = (*surface.values["color"], 1.0)
    if surface.colour_socket is not None and surface.colour_socket.is_linked:
        link(surface.colour_socket.links[0].from_socket, node.inputs["Color"])
    node.inputs["Strength"].default_value = surface.diffuse_share()
    if hasattr(material, "cycles"):
        # Paths find the light where they meet it; shadow rays to every lit surface would be noise.
        node["emission_sampling"] = material.cycles.emission_sampling
        material.cycles.emission_sampling = "NONE"
    return None


def give_material(item):
    """An object without materials gets one of ours."""
    if any(slot.material for slot in item.material_slots):
        return
    matte = bpy.data.materials.get(MATTE) or bpy.data.materials.new(MATTE)
    matte.use_nodes = True
    if item.material_slots:
        item.material_slots[0].material = matte
    else:
        item.data.materials.append(matte)
        item.data[MATTE] = True


def write_layers(item, geometry, sides):
    """Writes coordinates into the mesh that shows them: the object's own where no modifier and no other object uses it
    and triangles agree at the corners of their polygon, else a copy of the baked one."""
    mesh, layers = item.data, {}
    fits = item.type == "MESH" and mesh.users == 1 and not item.modifiers and len(mesh.loops) == len(geometry.vertices)
    for side, uvs in sides.items():
        layers[side] = numpy.zeros((len(geometry.vertices), 2))
        layers[side][geometry.loops] = uvs
        fits = fits and numpy.abs(layers[side][geometry.loops] - uvs).max() < 1e-6
    if not fits:
        layers = {side: uvs.reshape(-1, 2) for side, uvs in sides.items()}
        mesh = copy_of(geometry, f"{item.name} as baked", [slot.material for slot in item.material_slots])
        modifier = item.modifiers.new(BAKED_MESH, "NODES")
        modifier.node_group = bpy.data.node_groups.get(BAKED_MESH) or baked_mesh_group()
        modifier.show_in_editmode = False
        socket = next(entry for entry in modifier.node_group.interface.items_tree if entry.name == "Object")
        modifier[socket.identifier] = bpy.data.objects.new(mesh.name, mesh)
    for side, layer in layers.items():
        add_layer(mesh, UV_LAYER if side == "front" else BACK_UV_LAYER, layer)


def add_layer(mesh, name, values):
    """A UV layer that does not become the active one."""
    layer = mesh.uv_layers.new(name=name, do_init=False)
    layer.uv.foreach_set("vector", numpy.ascontiguousarray(values, dtype=numpy.float32).ravel())
    return layer


def copy_of(geometry, name, materials):
    """The triangles of a baked mesh, with its normals and UV layers."""
    mesh, corners = bpy.data.meshes.new(name), geometry.loops.ravel()
    mesh.from_pydata(geometry.positions, [], geometry.vertices[geometry.loops], shade_flat=False)
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", geometry.slots.astype(numpy.int32))
    for layer_name, values in geometry.uvs.items():
        add_layer(mesh, layer_name, values[corners]).active_render = layer_name == geometry.active_uv
    mesh.normals_split_custom_set(geometry.normals[corners])
    return mesh


def baked_mesh_group():
    """Shows another object's mesh instead of one's own."""
    tree = node_group(
        BAKED_MESH, "GeometryNodeTree",
        [("Geometry", "INPUT", "Geometry"), ("Object", "INPUT", "Object"), ("Geometry", "OUTPUT", "Geometry")],
        {"given": ("NodeGroupInput", {}), "shown": ("GeometryNodeObjectInfo", {}), "result": ("NodeGroupOutput", {})},
        [("given", "Object", "shown", "Object"), ("shown", "Geometry", "result", "Geometry")])
    tree.is_modifier = True
    return tree


def remove(context):
    """Takes away everything that `put_back` added; whether there was anything."""
    # What refers to our data-blocks is undone first; the blocks themselves go together at the end.
    named = [(bpy.data.node_groups, LIGHT_MAP_GROUP), (bpy.data.node_groups, BAKED_MESH), (bpy.data.images, IMAGE)]
    ours = [block for blocks, name in named for block in blocks if is_ours(block, name)]

    # The shader that fed the group feeds again what came behind it.
    for material in bpy.data.materials:
        tree = material.node_tree
        for node in [node for node in (tree.nodes if tree else ()) if node.type == "GROUP" and node.node_tree in ours]:
            if "emission_sampling" in node:
                material.cycles.emission_sampling = node["emission_sampling"]
            for before in list(node.inputs["Shader"].links):
                for after in list(node.outputs["Shader"].links):
                    tree.links.new(before.from_socket, after.to_socket)
            tree.nodes.remove(node)

    # The modifier goes with the copy of the baked mesh that it showed.
    for item in bpy.data.objects:
        for modifier in [one for one in item.modifiers if one.type == "NODES" and is_ours(one, BAKED_MESH)]:
            for copy in [value for value in modifier.values() if isinstance(value, bpy.types.Object)]:
                ours += copy, copy.data
            item.modifiers.remove(modifier)

    # Meshes of linked libraries have none of our layers and may not be changed.
    for mesh in bpy.data.meshes:
        for name in (UV_LAYER, BACK_UV_LAYER):
            if mesh.library is None and name in mesh.uv_layers:
                mesh.uv_layers.remove(mesh.uv_layers[name])

    # Our stand-in material is taken from where it was put and still is the only one.
    matte = bpy.data.materials.get(MATTE)
    if matte is not None:
        for owner in (*bpy.data.meshes, *bpy.data.curves, *bpy.data.metaballs):
            if owner.pop(MATTE, False) and list(owner.materials) == [matte]:
                owner.materials.clear()
        ours.append(matte)

    bpy.data.batch_remove(ours)
    for name, value in zip(CAUSTIC_FLAGS, context.scene.pop(CAUSTICS, ())):
        setattr(context.scene.cycles, name, bool(value))
    return bool(ours)
