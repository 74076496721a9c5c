"""The Blender add-on from end to end: a wine glass on a table, baked, shown by Cycles, and taken away again.

Arguments: EXTENSION.zip FOLDER (for pictures) [NEPHROID] (the one inside otherwise)
"""

import json
import math
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import addon_setup  # Before bpy.
import bpy
import numpy
from addon_setup import absorb, check, material, pixels

LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
# Largest difference of a flux from the manifest's [1]: that of sampling it.
BOUND = 0.01
SIZE = (480, 360)
SAMPLES = 24
# Side of the blocks whose means are compared [pixels].
BLOCK = 8
PLACES = 1_000_000
KINDS = ("objects", "meshes", "materials", "node_groups", "images", "worlds", "scenes", "cameras", "lights", "collections")


def link(name, data, **values):
    """An object in the scene."""
    item = bpy.data.objects.new(name, data)
    for key, value in values.items():
        setattr(item, key, value)
    bpy.context.scene.collection.objects.link(item)
    return item


def lathe(name, profile, shader):
    """A closed body of revolution about z from (radius, height) points, bottom to top to bottom, both ends on the axis."""
    mesh = bpy.data.meshes.new(name)
    edges = [(end - 1, end) for end in range(1, len(profile))]
    mesh.from_pydata([(radius, 0.0, height) for radius, height in profile], edges, [])
    mesh.materials.append(shader)
    # Two surfaces in the same place are met in an order that rounding decides: the foot stays off the table.
    screw = link(name, mesh, location=(0.0, 0.0, 2e-4)).modifiers.new("Screw", "SCREW")
    screw.steps = screw.render_steps = 128
    screw.use_merge_vertices, screw.merge_threshold = True, 1e-6
    screw.use_smooth_shade = screw.use_normal_flip = True


def curve(points, between=8):
    """A Catmull-Rom curve through points."""
    points = numpy.array([points[0], *points, points[-1]])
    line = []
    for a, b, c, d in zip(points, points[1:], points[2:], points[3:]):
        for t in numpy.arange(between) / between:
            line.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))
    return [tuple(map(float, point)) for point in [*line, points[-1]]]


def wine_glass():
    """The glass and the wine in it, which reaches a hair into the glass."""
    outside = curve([(0.034, 0.0015), (0.012, 0.004), (0.0045, 0.015), (0.004, 0.05), (0.006, 0.075), (0.024, 0.095),
                     (0.036, 0.125), (0.037, 0.15), (0.031, 0.185)])
    inside = curve([(0.0295, 0.185), (0.0355, 0.15), (0.0345, 0.125), (0.022, 0.098), (0.008, 0.083)])
    clear = dict(Base_Color=(1, 1, 1, 1), Transmission_Weight=1.0, Roughness=0.0)
    lathe("Glass", [(0.0, 0.0), (0.034, 0.0), *outside, *inside, (0.0, 0.081)],
          material("BsdfPrincipled", "Crystal", IOR=1.5, **clear)[0])
    level, red = 0.135, material("BsdfPrincipled", "Wine", IOR=1.34, **clear)[0]
    absorb(red, (0.9, 0.25, 0.32, 1.0), 45.0)
    below = [(radius + 2e-4, height) for radius, height in reversed(inside) if height < level]
    lathe("Wine", [(0.0, 0.0808), *below, (below[-1][0], level), (below[-1][0] - 1e-3, level), (0.0, level)], red)


def scene():
    """A glass on a table of wood with two coasters, before a wall; low sun."""
    wine_glass()
    wood, shader = material("BsdfPrincipled", "Wood", Roughness=0.5)
    tree = wood.node_tree
    wave, ramp, coordinates = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexWave", "ValToRGB", "TexCoord"))
    wave.inputs["Scale"].default_value, wave.inputs["Distortion"].default_value = 3.0, 6.0
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.28, 0.14, 0.06, 1.0), (0.42, 0.23, 0.11, 1.0)
    for start, end in [(coordinates.outputs["Object"], wave.inputs["Vector"]), (wave.outputs["Color"], ramp.inputs[0]),
                       (ramp.outputs["Color"], shader.inputs["Base Color"])]:
        tree.links.new(start, end)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.1, 0.0, -0.015))
    table = bpy.context.object
    table.name, table.scale = "Table", (0.8, 0.55, 0.03)
    bevel = table.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.01, 4
    table.data.materials.append(wood)
    felt, _ = material("BsdfPrincipled", "Felt", Base_Color=(0.55, 0.52, 0.45, 1.0), Roughness=0.9)
    bpy.ops.mesh.primitive_plane_add(size=0.09, location=(0.12, 0.04, 0.001))
    bpy.context.object.name = "Coaster"
    bpy.context.object.data.materials.append(felt)
    link("Second coaster", bpy.context.object.data, location=(0.23, -0.06, 0.001))
    # Without UV maps.
    bpy.ops.mesh.primitive_plane_add(size=1.2, location=(0.1, 0.29, 0.4), rotation=(0.5 * math.pi, 0.0, 0.0), calc_uvs=False)
    bpy.context.object.name = "Wall"
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.02, location=(0.2, 0.06, 0.021), calc_uvs=False)
    bpy.context.object.name = "Ball"
    # A slot, but no material.
    bpy.context.object.data.materials.append(None)
    bpy.ops.object.shade_smooth()
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle, sun.color = 4.0, 0.0093, (1.0, 0.92, 0.8)
    link("Sun", sun, rotation_euler=(math.radians(18.0), math.radians(-42.0), 0.0))
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.25, 0.28, 0.35, 1)
    bpy.context.scene.camera = link("Camera", bpy.data.cameras.new("Camera"), location=(0.12, -0.68, 0.38),
                                    rotation_euler=(math.radians(64.0), 0.0, math.radians(2.0)))
    bpy.context.view_layer.update()


def picture(path):
    """Renders by Cycles; means of luminance over blocks of pixels."""
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = SIZE
    cycles.samples, cycles.use_denoising, cycles.seed = SAMPLES, False, 1
    bpy.ops.render.render()
    for kind in ("PNG", "OPEN_EXR"):
        render.image_settings.file_format = kind
        bpy.data.images["Render Result"].save_render(str(path.with_suffix(f".{kind[-3:].lower()}")))
    luminance = pixels(path.with_suffix(".exr")) @ LUMINANCE
    return luminance.reshape(SIZE[1] // BLOCK, BLOCK, SIZE[0] // BLOCK, BLOCK).mean(axis=(1, 3))


def state():
    """All that a file holds and a bake might touch."""
    found = {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in KINDS}
    found["images"] = [name for name in found["images"] if name not in {"Render Result", "Viewer Node"}]
    for item in bpy.data.objects:
        modifiers = [(one.name, one.show_viewport, one.show_render) for one in item.modifiers]
        found["object", item.name] = modifiers, [slot.material and slot.material.name for slot in item.material_slots]
    for mesh in bpy.data.meshes:
        materials = [one and one.name for one in mesh.materials]
        found["mesh", mesh.name] = [layer.name for layer in mesh.uv_layers], len(mesh.loops), materials
    for made in bpy.data.materials:
        tree = made.node_tree
        links = sorted((one.from_node.name, one.from_socket.name, one.to_node.name, one.to_socket.name) for one in tree.links)
        found["material", made.name] = links, sorted(tree.nodes.keys()), made.cycles.emission_sampling
    cycles = bpy.context.scene.cycles
    found["scene"] = sorted(bpy.context.scene.keys()), cycles.caustics_reflective, cycles.caustics_refractive
    return found


def flux_w(addon):
    """What the maps in the file say falls on the evaluated meshes [W]: E of places all over their triangles."""
    file, tiles = Path(bpy.app.tempdir) / "tile.exr", {}
    for packed in bpy.data.images[addon.lightmaps.IMAGE].packed_files:
        file.write_bytes(packed.packed_file.data)
        tiles[packed.tile_number] = math.pi * pixels(file) @ LUMINANCE
    # Evenly over the area, by an additive recurrence within triangles.
    index, total, read = numpy.arange(PLACES), 0.0, addon.scene.read
    s, t = numpy.sqrt(index * 0.7548776662 % 1.0), index * 0.5698402910 % 1.0
    shares = numpy.stack([1 - s, s * (1 - t), s * t], axis=1)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for item in [item for item in bpy.context.scene.objects if item.type == "MESH"]:
        mesh = item.evaluated_get(depsgraph).data
        mesh.calc_loop_triangles()
        loops = read(mesh.loop_triangles, "loops", "i", 3)
        places = read(mesh.vertices, "co", "f", 3) @ numpy.array(item.matrix_world.to_3x3()).T
        a, b, c = places[read(mesh.loops, "vertex_index", "i", 1)[loops]].swapaxes(0, 1)
        area = 0.5 * numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1)
        chosen = numpy.searchsorted(area.cumsum(), (index + 0.5) / PLACES * area.sum())
        for layer in {addon.scene.UV_LAYER, addon.scene.BACK_UV_LAYER} & set(mesh.uv_layers.keys()):
            uv = (read(mesh.uv_layers[layer].uv, "vector", "f", 2)[loops][chosen] * shares[..., None]).sum(axis=1)
            numbers = (1001 + numpy.floor(uv) @ (1, 10)).astype(int)
            for number in numpy.unique(numbers):
                y, x = (uv[numbers == number, ::-1] % 1.0 * tiles[number].shape).astype(int).T
                total += tiles[number][y, x].sum() * area.sum() / PLACES
    return total


def messages():
    return [(one.level, one.object, one.text) for one in bpy.context.window_manager.nephroid_messages]


def bakes(addon, folder):
    """Bake, pictures, flux, Remove, and a second bake over the first."""
    before, cycles = state(), bpy.context.scene.cycles
    cycles.caustics_reflective = cycles.caustics_refractive = False
    dark = picture(folder / "before")
    cycles.caustics_reflective = cycles.caustics_refractive = True
    job = addon.bake.running = addon.bake.Job(bpy.context)
    start = time.time()
    job.thread.join()
    manifest = json.loads((job.files.folder / "maps" / "manifest.json").read_text())
    operator = MagicMock()
    check("bake", addon.bake.NEPHROID_OT_bake.end(operator, bpy.context) == {"FINISHED"},
          f"in {time.time() - start:.1f} s, {operator.report.call_args_list}")
    wanted, found = manifest["energy_w"]["deposited"], flux_w(addon)
    check("flux of the maps", abs(found / wanted - 1.0) < BOUND, f"{found:.6f} W, {wanted:.6f} W in the manifest")
    check("some maps follow coordinates of their own", any(entry["uv_set"] == "generated" for entry in manifest["maps"]),
          [(entry["surface"], entry["side"], entry["uv_set"]) for entry in manifest["maps"]])
    check("Cycles' own caustics are off", not cycles.caustics_refractive)
    gain = picture(folder / "after") - dark
    check("there is light now where there was none", (gain > 0.05).sum() >= 10, f"{(gain > 0.05).sum()} blocks of pixels")
    check("and nowhere less", gain.min() > -0.02, f"{gain.min():.4f} at least")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "baked.blend"), compress=True)
    bpy.ops.nephroid.bake()
    check("a second bake replaces the first",
          [one.name for one in bpy.data.images if one.name.startswith("Nephroid")] == ["Nephroid light"])
    bpy.ops.nephroid.remove()
    after = state()
    check("Remove takes everything away", after == before,
          [key for key in {*before, *after} if before.get(key) != after.get(key)])


def cancels(addon):
    """In the middle, by the add-on's own hands: a modal operator gets no events without a window."""
    before = state()
    bpy.context.scene.nephroid.preset = "FINAL"
    job = addon.bake.running = addon.bake.Job(bpy.context)
    while job.stage != "caustic" and job.thread.is_alive():
        time.sleep(0.01)
    check("the bake tells how far it is", job.stage == "caustic" and 0.0 <= job.share <= 1.0, f"{job.stage} {job.share}")
    operator, kind = MagicMock(), addon.bake.NEPHROID_OT_bake
    operator.end = lambda context: kind.end(operator, context)
    outcome = kind.modal(operator, MagicMock(), SimpleNamespace(type="ESC"))
    check("cancel", outcome == {"CANCELLED"} and addon.bake.running is None and job.process.poll() is not None,
          operator.report.call_args_list)
    check("cancel leaves the file as it was", state() == before)
    check("cancel leaves no files", not job.files.folder.exists())
    bpy.context.scene.nephroid.preset = "DRAFT"


def refuses():
    """Scenes that cannot be baked, or only in part, and where it is said."""

    def told(what, *wanted):
        try:
            bpy.ops.nephroid.bake()
        except RuntimeError as error:
            # What an operator reports as an error, Python gets as an exception.
            print(f"    {str(error).strip()}")
        is_said = any(all(part in message for part, message in zip(wanted, one)) for one in messages())
        check(what, is_said and all(one[0] == wanted[0] and "--" not in one[2] for one in messages()), messages())

    crystal, settings = bpy.data.materials["Crystal"], bpy.context.scene.nephroid
    crystal.nephroid.glass = "unobtainium"
    told("an unknown glass is said on its object", "ERROR", "Glass", "unobtainium")
    crystal.nephroid.glass = ""
    sun = bpy.data.objects["Sun"]
    sun.hide_render = True
    told("a scene without light", "ERROR", "", "add a lamp that shows in renders")
    sun.hide_render = False
    chosen = settings.objects = bpy.data.collections.new("Receivers")
    chosen.objects.link(bpy.data.objects["Table"])
    told("a scene without glass", "ERROR", "", "no light falls on a surface by way of glass")
    bpy.data.collections.remove(chosen)
    noise = crystal.node_tree.nodes.new("ShaderNodeTexNoise")
    shader = next(node for node in crystal.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    crystal.node_tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    told("what is not read is said on its object", "WARNING", "Glass", "the nodes at its Roughness")
    crystal.node_tree.nodes.remove(noise)
    bpy.ops.nephroid.remove()


def panels(addon):
    """Panels name properties and operators that exist."""
    context = SimpleNamespace(scene=bpy.context.scene, window_manager=bpy.context.window_manager, region=None,
                              material=bpy.data.materials["Crystal"])
    for panel in addon.panel.CLASSES:
        drawn = MagicMock()
        panel.draw(drawn, context)
        for call, arguments, _ in drawn.layout.mock_calls:
            if call.split(".")[-1] == "prop":
                check(f"panel: {arguments[1]}", arguments[1] in arguments[0].bl_rna.properties)
            elif call.split(".")[-1] == "operator":
                check(f"panel: {arguments[0]}", arguments[0].split(".")[1] in dir(bpy.ops.nephroid))


def live(addon, folder):
    """The window's scene is written again when the open one changes; here a program that only waits stands for it."""
    waits = folder / "waits"
    waits.write_text("#!/bin/sh\necho \"$@\" > \"$2.arguments\"\nexec sleep 600\n")
    waits.chmod(0o755)
    preferences = bpy.context.preferences.addons[addon_setup.MODULE].preferences
    kept, preferences.program = preferences.program, str(waits)
    bpy.ops.nephroid.live()
    view = addon.bake.live
    first = view.files.scene.read_bytes()
    view.look()
    view.look()
    check("live: nothing is written while nothing changes", view.files.scene.read_bytes() == first and not view.is_changed)
    bpy.data.objects["Glass"].location.x += 0.02
    bpy.context.view_layer.update()
    view.look()
    bpy.data.objects["Glass"].location.x -= 0.02
    check("live: a change is written", view.files.scene.read_bytes() != first)
    arguments = Path(f"{view.files.scene}.arguments").read_text()
    check("live: the window watches", "view" in arguments and "--watch" in arguments, arguments.strip())
    bpy.ops.nephroid.live()
    check("live: closed", addon.bake.live is None and view.process.poll() is not None and not view.files.folder.exists())
    preferences.program = kept
    waits.unlink()


def main():
    extension, folder, *program = sys.argv[1:]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    addon = addon_setup.install(extension, *program)
    addon_setup.empty()
    scene()
    panels(addon)
    live(addon, folder)
    cancels(addon)
    refuses()
    bakes(addon, folder)
    addon_setup.finish()


main()
