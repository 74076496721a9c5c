"""The Blender add-on from end to end: a wine glass on a table, baked, shown by Cycles, and taken away again.

Arguments: EXTENSION.zip FOLDER (for pictures)
"""

import json
import math
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import addon_setup  # Before bpy.
import bpy
import numpy

LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
# Largest difference of a flux from the manifest's [1]: that of sampling it.
BOUND = 0.01
SIZE = (480, 360)
SAMPLES = 24
# Side of the blocks whose means are compared [pixels].
BLOCK = 8
PLACES = 1_000_000

faults = []


def check(what, is_right, told=""):
    print(f"{'ok' if is_right else 'WRONG'}: {what} {told}")
    if not is_right:
        faults.append(what)


def material(name, **inputs):
    """A Principled BSDF."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made, shader


def lathe(name, profile, steps=128):
    """A closed body of revolution about z from (radius, height) points, bottom to top to bottom, both ends on the axis."""
    inner = profile[1:-1]
    vertices = [(0.0, 0.0, profile[0][1])]
    for radius, height in inner:
        vertices += [(radius * math.cos(2 * math.pi * step / steps), radius * math.sin(2 * math.pi * step / steps), height)
                     for step in range(steps)]
    vertices.append((0.0, 0.0, profile[-1][1]))
    faces = [(0, 1 + (step + 1) % steps, 1 + step) for step in range(steps)]
    for ring in range(len(inner) - 1):
        a, b = 1 + ring * steps, 1 + (ring + 1) * steps
        faces += [(a + step, a + (step + 1) % steps, b + (step + 1) % steps, b + step) for step in range(steps)]
    last = 1 + (len(inner) - 1) * steps
    faces += [(last + step, last + (step + 1) % steps, len(vertices) - 1) for step in range(steps)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


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
    body = [(0.0, 0.0), (0.034, 0.0), *outside, *inside, (0.0, 0.081)]
    glass = lathe("Glass", body)
    clear, _ = material("Crystal", Base_Color=(1, 1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.5)
    glass.data.materials.append(clear)
    level = 0.135
    below = [(radius + 2e-4, height) for radius, height in reversed(inside) if height < level]
    wine = lathe("Wine", [(0.0, 0.0808), *below, (below[-1][0], level), (below[-1][0] - 1e-3, level), (0.0, level)])
    red, _ = material("Wine", Base_Color=(1, 1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.34)
    tree = red.node_tree
    absorbs = tree.nodes.new("ShaderNodeVolumeAbsorption")
    absorbs.inputs["Color"].default_value, absorbs.inputs["Density"].default_value = (0.9, 0.25, 0.32, 1.0), 45.0
    end = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(absorbs.outputs[0], end.inputs["Volume"])
    wine.data.materials.append(red)
    # Two surfaces in the same place are met in an order that rounding decides.
    glass.location.z = wine.location.z = 2e-4


def scene():
    """A glass on a table of wood with two coasters, before a wall; low sun."""
    wine_glass()
    wood, shader = material("Wood", Roughness=0.5)
    tree = wood.node_tree
    wave, ramp = tree.nodes.new("ShaderNodeTexWave"), tree.nodes.new("ShaderNodeValToRGB")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    wave.inputs["Scale"].default_value, wave.inputs["Distortion"].default_value = 3.0, 6.0
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.28, 0.14, 0.06, 1.0), (0.42, 0.23, 0.11, 1.0)
    tree.links.new(coordinates.outputs["Object"], wave.inputs["Vector"])
    tree.links.new(wave.outputs["Color"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.1, 0.0, -0.015))
    table = bpy.context.object
    table.name, table.scale = "Table", (0.8, 0.55, 0.03)
    bevel = table.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.01, 4
    table.data.materials.append(wood)
    felt, _ = material("Felt", Base_Color=(0.55, 0.52, 0.45, 1.0), Roughness=0.9)
    bpy.ops.mesh.primitive_plane_add(size=0.09, location=(0.12, 0.04, 0.001))
    first = bpy.context.object
    first.name = "Coaster"
    first.data.materials.append(felt)
    second = bpy.data.objects.new("Second coaster", first.data)
    second.location = (0.23, -0.06, 0.001)
    bpy.context.scene.collection.objects.link(second)
    # Without UV maps.
    bpy.ops.mesh.primitive_plane_add(size=1.2, location=(0.1, 0.29, 0.4), rotation=(0.5 * math.pi, 0.0, 0.0), calc_uvs=False)
    bpy.context.object.name = "Wall"
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.02, location=(0.2, 0.06, 0.021), calc_uvs=False)
    bpy.context.object.name = "Ball"
    bpy.context.object.data.materials.append(felt)
    bpy.ops.object.shade_smooth()
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle, sun.color = 4.0, 0.0093, (1.0, 0.92, 0.8)
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.rotation_euler = (math.radians(18.0), math.radians(-42.0), 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    next(node for node in world.node_tree.nodes if node.type == "BACKGROUND").inputs["Color"].default_value = (0.25, 0.28, 0.35, 1)
    bpy.context.scene.world = world
    lens = bpy.data.cameras.new("Camera")
    lens.lens = 50.0
    camera = bpy.data.objects.new("Camera", lens)
    camera.location, camera.rotation_euler = (0.12, -0.68, 0.38), (math.radians(64.0), 0.0, math.radians(2.0))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()


def picture(path, samples=SAMPLES):
    """Renders by Cycles; luminance of the pixels."""
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = SIZE
    cycles.samples, cycles.use_denoising, cycles.seed = samples, False, 1
    for kind in ("PNG", "OPEN_EXR"):
        render.image_settings.file_format = kind
        render.filepath = str(path.with_suffix(".png" if kind == "PNG" else ".exr"))
        bpy.ops.render.render(write_still=True) if kind == "PNG" else bpy.data.images["Render Result"].save_render(render.filepath)
    image = bpy.data.images.load(render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = numpy.array(image.pixels[:]).reshape(-1, 4)[:, :3] @ LUMINANCE
    bpy.data.images.remove(image)
    return pixels


def state():
    """All that a file holds and a bake might touch."""
    found = {}
    for kind in ("objects", "meshes", "materials", "node_groups", "images", "worlds", "scenes", "cameras", "lights", "collections"):
        found[kind] = sorted(block.name for block in getattr(bpy.data, kind) if block.name not in {"Render Result", "Viewer Node"})
    for item in bpy.data.objects:
        modifiers = [(one.name, one.show_viewport, one.show_render) for one in item.modifiers]
        found["object", item.name] = modifiers, [slot.material and slot.material.name for slot in item.material_slots]
    for mesh in bpy.data.meshes:
        materials = [one and one.name for one in mesh.materials]
        found["mesh", mesh.name] = [layer.name for layer in mesh.uv_layers], len(mesh.loops), materials
    for made in bpy.data.materials:
        links = made.node_tree.links
        found["material", made.name] = sorted((link.from_node.name, link.from_socket.name, link.to_node.name, link.to_socket.name)
                                              for link in links), sorted(node.name for node in made.node_tree.nodes)
        found["sampling", made.name] = made.cycles.emission_sampling
    cycles = bpy.context.scene.cycles
    found["scene"] = sorted(bpy.context.scene.keys()), cycles.caustics_reflective, cycles.caustics_refractive
    return found


def flux_w(addon):
    """What the maps in the file say falls on the evaluated meshes [W]: E of places all over their triangles."""
    image = bpy.data.images[addon.lightmaps.IMAGE]
    folder = Path(bpy.app.tempdir) / "tiles"
    tiles = {}
    for packed in image.packed_files:
        file = folder / f"{packed.tile_number}.exr"
        folder.mkdir(exist_ok=True)
        file.write_bytes(packed.packed_file.data)
        tile = bpy.data.images.load(str(file))
        tile.colorspace_settings.name = "Non-Color"
        tiles[packed.tile_number] = numpy.array(tile.pixels[:]).reshape(tile.size[1], tile.size[0], 4)[..., :3]
        bpy.data.images.remove(tile)
    random, total = numpy.random.default_rng(1), 0.0
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for item in bpy.context.scene.objects:
        mesh = item.evaluated_get(depsgraph).data
        if item.type != "MESH":
            continue
        for layer in (addon.scene.UV_LAYER, addon.scene.BACK_UV_LAYER):
            if layer not in mesh.uv_layers:
                continue
            mesh.calc_loop_triangles()
            loops = addon.scene.read(mesh.loop_triangles, "loops", "i", 3)
            corners = addon.scene.read(mesh.loops, "vertex_index", "i", 1)[loops]
            places = addon.scene.read(mesh.vertices, "co", "f", 3) @ numpy.array(item.matrix_world.to_3x3()).T
            uv = addon.scene.read(mesh.uv_layers[layer].uv, "vector", "f", 2).astype(float)[loops]
            a, b, c = (places[corners[:, corner]] for corner in range(3))
            area = 0.5 * numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1)
            chosen = random.choice(len(area), PLACES, p=area / area.sum())
            s, t = numpy.sqrt(random.random(len(chosen))), random.random(len(chosen))
            at = (uv[chosen] * numpy.stack([1 - s, s * (1 - t), s * t], axis=1)[..., None]).sum(axis=1)
            tile_uv = numpy.floor(at)
            numbers = (1001 + tile_uv[:, 0] + 10 * tile_uv[:, 1]).astype(int)
            for number in numpy.unique(numbers):
                rows = numbers == number
                pixels = tiles[number]
                y, x = ((at[rows] - tile_uv[rows])[:, ::-1] * pixels.shape[:2]).astype(int).T
                total += math.pi * (pixels[y, x] @ LUMINANCE).sum() * area.sum() / len(chosen)
    return total


def messages():
    return [(one.level, one.object, one.text) for one in bpy.context.window_manager.nephroid_messages]


def bakes(addon, folder):
    """Bake, pictures, flux, Remove, and a second bake over the first."""
    settings = bpy.context.scene.nephroid
    settings.map_size, settings.preset = "256", "DRAFT"
    before = state()
    bpy.context.scene.cycles.caustics_reflective = bpy.context.scene.cycles.caustics_refractive = False
    dark = picture(folder / "before")
    bpy.context.scene.cycles.caustics_reflective = bpy.context.scene.cycles.caustics_refractive = True
    manifests = []
    finish = addon.bake.Job.finish

    def finish_and_keep(job, context):
        manifests.append(json.loads((job.files.folder / "maps" / "manifest.json").read_text()))
        return finish(job, context)

    addon.bake.Job.finish = finish_and_keep
    start = time.time()
    check("bake", bpy.ops.nephroid.bake() == {"FINISHED"}, f"in {time.time() - start:.1f} s, {messages()}")
    addon.bake.Job.finish = finish
    manifest, = manifests
    wanted, found = manifest["energy_w"]["deposited"], flux_w(addon)
    check("flux of the maps", abs(found / wanted - 1.0) < BOUND, f"{found:.6f} W, {wanted:.6f} W in the manifest")
    check("some maps follow coordinates of their own", any(entry["uv_set"] == "generated" for entry in manifest["maps"]),
          [(entry["surface"], entry["side"], entry["uv_set"]) for entry in manifest["maps"]])
    check("Cycles' own caustics are off", not bpy.context.scene.cycles.caustics_refractive)
    lit = picture(folder / "after")
    gain = (lit - dark).reshape(SIZE[1] // BLOCK, BLOCK, SIZE[0] // BLOCK, BLOCK).mean(axis=(1, 3))
    check("there is light now where there was none", (gain > 0.05).sum() >= 10, f"{(gain > 0.05).sum()} blocks of pixels")
    check("and nowhere less", gain.min() > -0.02, f"{gain.min():.4f} at least")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "baked.blend"), compress=True)
    settings.map_size = "128"
    bpy.ops.nephroid.bake()
    check("a second bake replaces the first",
          [one.name for one in bpy.data.images if one.name.startswith("Nephroid")] == ["Nephroid light"])
    bpy.ops.nephroid.remove()
    after = state()
    check("Remove takes everything away", after == before, [key for key in {*before, *after} if before.get(key) != after.get(key)])


def cancels(addon):
    """In the middle, by the add-on's own hands: a modal operator gets no events without a window."""
    before = state()
    settings = bpy.context.scene.nephroid
    settings.preset = "FINAL"
    job = addon.bake.running = addon.bake.Job(bpy.context)
    while job.stage != "caustic" and not job.poll():
        time.sleep(0.01)
    check("the bake tells how far it is", job.stage == "caustic" and 0.0 <= job.share <= 1.0, f"{job.stage} {job.share}")
    told = []
    manager = SimpleNamespace(event_timer_remove=lambda timer: None, progress_end=lambda: None,
                              nephroid_messages=bpy.context.window_manager.nephroid_messages)
    operator = SimpleNamespace(timer=None, report=lambda *message: told.append(message))
    operator.stopped = lambda context: addon.bake.NEPHROID_OT_bake.stopped(operator, context)
    outcome = addon.bake.NEPHROID_OT_bake.modal(operator, SimpleNamespace(window_manager=manager), SimpleNamespace(type="ESC"))
    check("cancel", outcome == {"CANCELLED"} and addon.bake.running is None and job.process.poll() is not None, told)
    check("cancel leaves the file as it was", state() == before)
    check("cancel leaves no files", not job.files.folder.exists())
    settings.preset = "DRAFT"


def refuses(addon):
    """Scenes that cannot be baked, or only in part, and where it is said."""

    def told(what, *wanted):
        try:
            bpy.ops.nephroid.bake()
        except RuntimeError as error:
            # What an operator reports as an error, Python gets as an exception.
            print(f"    {str(error).strip()}")
        is_said = any(all(part in message for part, message in zip(wanted, one)) for one in messages())
        check(what, is_said and all(one[0] == wanted[0] for one in messages()), messages())

    crystal = bpy.data.materials["Crystal"]
    crystal.nephroid.glass = "unobtainium"
    told("an unknown glass is said on its object", "ERROR", "Glass", "unobtainium")
    crystal.nephroid.glass = ""
    sun = bpy.data.objects["Sun"]
    sun.hide_render = True
    told("a scene without light", "ERROR", "", "no light")
    sun.hide_render = False
    chosen = bpy.data.collections.new("Receivers")
    chosen.objects.link(bpy.data.objects["Table"])
    bpy.context.scene.nephroid.objects = chosen
    told("a scene without glass", "ERROR", "", "there is no light to show")
    bpy.context.scene.nephroid.objects = None
    bpy.data.collections.remove(chosen)
    noise = crystal.node_tree.nodes.new("ShaderNodeTexNoise")
    shader = next(node for node in crystal.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    crystal.node_tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    bpy.context.scene.nephroid.map_size = "128"
    told("what is not read is said on its object", "WARNING", "Glass", "the nodes at its Roughness")
    crystal.node_tree.nodes.remove(noise)
    bpy.ops.nephroid.remove()


def panels(addon):
    """Panels name properties and operators that exist."""

    class Layout:
        def prop(self, owner, name, **options):
            check(f"panel: {name}", name in owner.bl_rna.properties)

        def operator(self, name, **options):
            group, operator = name.split(".")
            check(f"panel: {name}", hasattr(getattr(bpy.types, f"NEPHROID_OT_{operator}", None), "bl_rna"))
            return SimpleNamespace()

        def __getattr__(self, name):
            return lambda *arguments, **options: self

    context = SimpleNamespace(scene=bpy.context.scene, window_manager=bpy.context.window_manager, region=None,
                              material=bpy.data.materials["Crystal"])
    for panel in addon.panel.CLASSES:
        drawn = SimpleNamespace(layout=Layout())
        drawn.messages = lambda context: panel.messages(drawn, context)
        panel.draw(drawn, context)


def live(addon, folder):
    """The window's scene is written again when the open one changes; here a program that only waits stands for it."""
    waits = folder / "waits"
    waits.write_text("#!/bin/sh\necho \"$@\" > \"$2.arguments\"\nexec sleep 600\n")
    waits.chmod(0o755)
    preferences = bpy.context.preferences.addons[addon_setup.MODULE].preferences
    preferences.program = str(waits)
    bpy.ops.nephroid.live()
    view = addon.bake.live
    first = view.files.scene.read_bytes()
    view.look()
    view.look()
    check("live: nothing is written while nothing changes", view.files.scene.read_bytes() == first and not view.is_changed)
    bpy.data.objects["Glass"].location.x += 0.02
    bpy.context.view_layer.update()
    view.look()
    check("live: a change is written", view.files.scene.read_bytes() != first)
    arguments = Path(f"{view.files.scene}.arguments").read_text()
    check("live: the window watches", "view" in arguments and "--watch" in arguments, arguments.strip())
    bpy.ops.nephroid.live()
    check("live: closed", addon.bake.live is None and view.process.poll() is not None and not view.files.folder.exists())
    preferences.program = ""


def main():
    extension, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    addon = addon_setup.install(extension)
    addon_setup.empty()
    scene()
    panels(addon)
    live(addon, folder)
    cancels(addon)
    refuses(addon)
    bakes(addon, folder)
    if faults:
        sys.exit("addon_wine_glass: " + "; ".join(faults))


main()
