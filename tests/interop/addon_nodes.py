"""The table of Blender's nodes: each row as glTF, and the light that it makes beside Cycles'.

Arguments: EXTENSION.zip [NEPHROID] (the one inside otherwise)
"""

import json
import math
import sys

import addon_setup  # Before bpy.
import bpy
import numpy
from addon_setup import absorb, check, empty, material, pixels

# Largest difference of a mean irradiance from Cycles' [1].
BOUND = 0.03
SAMPLES = 2048
SIDE = 8


def equal(what, found, wanted, bound=1e-5):
    """Checks numbers, lists of them or texts."""
    numbers = numpy.asarray(wanted)
    is_right = found == wanted
    if found is not None and numbers.size and numbers.dtype.kind in "if":
        is_right = numpy.shape(found) == numbers.shape and numpy.allclose(found, numbers, rtol=bound, atol=1e-7)
    check(what, is_right, f"{found}, {wanted} wanted")


def pick(document, path):
    """What stands in a glTF material under a path; None without it."""
    for step in path.split("/"):
        document = document.get(step) if isinstance(document, dict) else None
    return document


def rows(addon):
    """Every row of the table: the node, what its glTF has, and the words about what is lost."""
    red = (0.64, 0.25, 0.04, 1.0)
    pbr, factor = "pbrMetallicRoughness", "extensions/KHR_materials_transmission/transmissionFactor"
    color, metallic, roughness = f"{pbr}/baseColorFactor", f"{pbr}/metallicFactor", f"{pbr}/roughnessFactor"
    volume, coat = "extensions/KHR_materials_volume", "extensions/KHR_materials_clearcoat"
    ior, glow = "extensions/KHR_materials_ior/ior", "extensions/KHR_materials_emissive_strength/emissiveStrength"
    table = [
        ("BsdfPrincipled", dict(Base_Color=red, Metallic=0.0, Roughness=0.7),
         {color: red, roughness: 0.7, metallic: 0.0, factor: None}, ""),
        ("BsdfPrincipled", dict(Metallic=1.0, Roughness=0.1), {metallic: 1.0, roughness: 0.1}, ""),
        ("BsdfPrincipled", dict(Base_Color=red, Transmission_Weight=1.0, IOR=1.33, Roughness=0.2),
         {factor: 1.0, ior: 1.33, roughness: 0.2, color: [0.8, 0.5, 0.2, 1.0], f"{volume}/thicknessFactor": 1.0}, ""),
        ("BsdfPrincipled", dict(Coat_Weight=0.5, Coat_Roughness=0.1),
         {f"{coat}/clearcoatFactor": 0.5, f"{coat}/clearcoatRoughnessFactor": 0.1}, ""),
        ("BsdfPrincipled", dict(Coat_Weight=0.5, Coat_IOR=2.0), {f"{coat}/clearcoatFactor": 0.5},
         "its coat was read with an index of 1.5"),
        ("BsdfPrincipled", dict(Specular_IOR_Level=0.25), {"extensions/KHR_materials_specular/specularFactor": 0.5}, ""),
        ("BsdfPrincipled", dict(Alpha=0.25), {"alphaMode": "BLEND", color: [0.8, 0.8, 0.8, 0.25]}, ""),
        ("BsdfPrincipled", dict(Emission_Color=(2.0, 1.0, 0.5, 1.0), Emission_Strength=3.0),
         {"emissiveFactor": [1.0, 0.5, 0.25], glow: 6.0 * 683.0}, ""),
        ("BsdfPrincipled", dict(Sheen_Weight=1.0), {}, "its Sheen Weight was ignored"),
        ("BsdfPrincipled", dict(Thin_Film_Thickness=300.0), {}, "its Thin Film Thickness was ignored"),
        ("BsdfGlass", dict(Color=red, Roughness=0.0, IOR=1.6), {factor: 1.0, color: red, roughness: 0.0, ior: 1.6}, ""),
        ("BsdfRefraction", dict(IOR=1.4), {factor: 1.0, ior: 1.4},
         "its Refraction BSDF was read as glass, which reflects as well"),
        ("BsdfAnisotropic", dict(Color=red, Roughness=0.05), {metallic: 1.0, color: red, roughness: 0.05}, ""),
        ("BsdfDiffuse", dict(Color=red), {metallic: 0.0, roughness: 1.0, color: red}, ""),
        ("BsdfTransparent", {}, {"alphaMode": "BLEND", color: [0.0, 0.0, 0.0, 0.0]}, ""),
        ("Emission", dict(Color=(1.0, 0.5, 0.0, 1.0), Strength=2.0),
         {"emissiveFactor": [1.0, 0.5, 0.0], glow: 2.0 * 683.0}, ""),
    ]
    table += [(kind, dict(Color=red), {color: red, roughness: 1.0, metallic: 0.0},
               f"its {getattr(bpy.types, f'ShaderNode{kind}').bl_rna.name} was read as matte: no light goes through")
              for kind in ("BsdfTranslucent", "SubsurfaceScattering", "BsdfSheen", "BsdfToon", "BsdfHair")]
    untested = set(addon.materials.NODES)
    if hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        table.append(("BsdfMetallic", dict(Base_Color=red, Roughness=0.0), {metallic: 1.0, color: red}, ""))
    else:
        untested.remove("BSDF_METALLIC")
    for kind, inputs, wanted, word in table:
        made, node = material(kind, **inputs)
        untested.discard(node.type)
        surface = addon.materials.Surface(made)
        document = surface.gltf(lambda node: {"index": 0})
        name = f"{kind} {' '.join(inputs)}"
        for path, value in wanted.items():
            equal(f"{name}: {path}", pick(document, path), value)
        equal(f"{name}: words", "; ".join(surface.faults), word)
    equal("rows without a test", untested, set())


def special_rows(addon):
    """What is not a node's own: volumes, thin walls, glasses, mixtures, images."""

    def read():
        surface = addon.materials.Surface(made)
        return surface.gltf(lambda node: {"index": node.image.name}), surface.faults

    made, _ = material("BsdfGlass")
    absorb(made, (0.9, 0.5, 0.1, 1.0), 4.0)
    stated = read()[0]["extensions"]["KHR_materials_volume"]
    equal("Volume Absorption after 0.3 m", [c ** (0.3 / stated["attenuationDistance"]) for c in stated["attenuationColor"]],
          [math.exp(-4.0 * (1 - c) * 0.3) for c in (0.9, 0.5, 0.1)])
    made.nephroid.is_thin, made.nephroid.glass = True, "N-BK7"
    made["metal"] = "gold"
    equal("thin wall", read()[0]["extensions"]["KHR_materials_volume"]["thicknessFactor"], 0.0)
    equal("glass by name and a custom property", read()[0]["extras"], {"metal": "gold", "glass": "N-BK7"})

    made, shader = material("BsdfGlass", IOR=1.7)
    tree = made.node_tree
    mix, clear, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "BsdfTransparent", "LightPath"))
    for start, end in [(path.outputs["Is Shadow Ray"], mix.inputs[0]), (shader.outputs[0], mix.inputs[1]),
                       (clear.outputs[0], mix.inputs[2]), (mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])]:
        tree.links.new(start, end)
    equal("glass with shadows of light", read()[0]["extensions"]["KHR_materials_ior"]["ior"], 1.7)
    tree.links.remove(mix.inputs[0].links[0])
    mix.inputs[0].default_value = 0.3
    equal("part of a Transparent BSDF", read()[0]["pbrMetallicRoughness"]["baseColorFactor"][3], 0.7)

    if hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        made, shader = material("BsdfMetallic")
        shader.fresnel_type = "PHYSICAL_CONDUCTOR"
        shader.inputs["IOR"].default_value = (1.0, 1.0, 1.0)
        shader.inputs["Extinction"].default_value = (2.0, 2.0, 2.0)
        equal("metal by index and extinction", read()[0]["pbrMetallicRoughness"]["baseColorFactor"], [0.5, 0.5, 0.5, 1.0])

    made, shader = material("BsdfPrincipled")
    tree = made.node_tree
    picture, noise = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "TexNoise"))
    picture.image = bpy.data.images.new("wood", 4, 4)
    tree.links.new(picture.outputs["Color"], shader.inputs["Base Color"])
    equal("image as colour", read()[0]["pbrMetallicRoughness"]["baseColorTexture"], {"index": "wood"})
    tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    equal("nodes that are not read", read()[1], ["the nodes at its Roughness are not read; its default was baked"])
    picture.image.source, picture.image.filepath = "FILE", "//lost.png"
    equal("an image that is missing", read()[1][0], "the image wood at its Base Color is missing or tiled; its default was baked")


def plane(name, size, location, turn=(0.0, 0.0, 0.0), shader=None):
    """A square, matte unless told otherwise. It is dark, so that what it sends back is no part of the comparison."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=location, rotation=turn)
    item = bpy.context.object
    item.name = name
    item.data.materials.append(shader or material("BsdfDiffuse", Color=(0.001, 0.001, 0.001, 1.0))[0])
    return item


def by_cycles(item):
    """Mean irradiance of a plane as Cycles bakes it [W/m²]."""
    scene, image = bpy.context.scene, bpy.data.images.new("irradiance", SIDE, SIDE, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", SAMPLES, 12
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0
    scene.render.bake.margin = 0
    tree = item.data.materials[0].node_tree
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image, tree.nodes.active = image, target
    bpy.ops.object.select_all(action="DESELECT")
    item.select_set(True)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    tree.nodes.remove(target)
    return math.pi * numpy.array(image.pixels[:]).reshape(-1, 4)[:, :3].mean(axis=0)


def compare(addon, what, *items):
    """Mean irradiances of planes as the add-on bakes them, beside Cycles' [W/m²]."""
    settings = bpy.context.scene.nephroid
    settings.layers, settings.map_size = "ALL", "128"
    job = addon.bake.Job(bpy.context)
    job.thread.join()
    check(f"{what}: bake", not job.failed, job.failed)
    folder, found = job.files.folder / "textures", {}
    for texture in json.loads((folder / "index.json").read_text())["textures"]:
        place, = texture["maps"]
        if place["side"] == "front":
            found[place["surface"]] = math.pi * pixels(folder / texture["file"]).mean(axis=(0, 1))
    job.files.remove()
    for item in items:
        means = [mean.round(4).tolist() for mean in (found[item.name], by_cycles(item))]
        equal(f"{what}: W/m² on {item.name}, beside Cycles", *means, BOUND)


def lamp(kind, energy, location=(0.0, 0.0, 2.0), turn=(0.0, 0.0, 0.0), **values):
    bpy.ops.object.light_add(type=kind, location=location, rotation=turn)
    data = bpy.context.object.data
    data.energy = energy
    for name, value in values.items():
        # Exposure and temperature came with Blender 4.5.
        if hasattr(data, name):
            setattr(data, name, value)


def lamps(addon):
    """Every kind of lamp, over a floor."""
    tilt = (0.4, 0.2, 0.0)
    for what, arguments in {
        "sun": dict(kind="SUN", energy=3.0, turn=tilt, angle=0.2),
        "brighter sun": dict(kind="SUN", energy=3.0, turn=tilt, angle=0.0, exposure=1.0, color=(1.0, 0.5, 0.25)),
        "point": dict(kind="POINT", energy=100.0, shadow_soft_size=0.1),
        "warm point": dict(kind="POINT", energy=100.0, shadow_soft_size=0.05, use_temperature=True, temperature=3000.0),
        "spot": dict(kind="SPOT", energy=100.0, turn=tilt, spot_size=0.6, spot_blend=0.0, shadow_soft_size=0.0),
        "square": dict(kind="AREA", energy=50.0, turn=tilt, shape="SQUARE", size=0.7),
        "rectangle": dict(kind="AREA", energy=50.0, turn=tilt, shape="RECTANGLE", size=1.0, size_y=0.3),
        "disc": dict(kind="AREA", energy=50.0, turn=tilt, shape="DISK", size=0.7),
    }.items():
        empty()
        floor = plane("floor", 2.0, (0.0, 0.0, 0.0))
        lamp(**arguments)
        compare(addon, what, floor)


def world(addon):
    """An image of a sky with a bright quarter, turned, on planes that face three ways."""
    empty()
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    sky_pixels = numpy.full((32, 64, 4), 0.1, dtype=numpy.float32)
    sky_pixels[18:26, 8:20, :3] = (5.0, 2.0, 1.0)
    image.pixels.foreach_set(sky_pixels.ravel())
    image.update()
    sky = bpy.context.scene.world = bpy.data.worlds.new("sky")
    sky.use_nodes = True
    tree = sky.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 2.0
    picture, mapping, coordinates = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord"))
    picture.image = image
    mapping.inputs["Rotation"].default_value[2] = 0.6
    for start, end in [(coordinates.outputs["Generated"], mapping.inputs["Vector"]),
                       (mapping.outputs["Vector"], picture.inputs["Vector"]),
                       (picture.outputs["Color"], background.inputs["Color"])]:
        tree.links.new(start, end)
    right = 0.5 * math.pi
    compare(addon, "world", plane("up", 1.0, (0.0, 0.0, 0.0)), plane("east", 1.0, (9.0, 0.0, 0.0), (0.0, right, 0.0)),
            plane("south", 1.0, (0.0, -9.0, 0.0), (right, 0.0, 0.0)))


def through(addon):
    """Floors under slabs and beside mirrors."""
    tint = (0.64, 0.36, 0.16, 1.0)
    for what, kind, inputs in [
        ("slab of Principled", "BsdfPrincipled", dict(Base_Color=tint, Transmission_Weight=1.0, Roughness=0.0, IOR=1.45)),
        ("slab of frosted Principled", "BsdfPrincipled", dict(Base_Color=(1, 1, 1, 1), Transmission_Weight=1.0, Roughness=0.4)),
        ("slab of Glass", "BsdfGlass", dict(Color=tint, IOR=1.6)),
        ("slab that absorbs", "BsdfGlass", dict(IOR=1.5)),
        ("mirror of Glossy", "BsdfAnisotropic", dict(Color=tint, Roughness=0.0)),
        ("rough mirror of Principled", "BsdfPrincipled", dict(Base_Color=tint, Metallic=1.0, Roughness=0.3)),
    ]:
        empty()
        shader, _ = material(kind, **inputs)
        floor = plane("floor", 1.0, (0.0, 0.0, 0.0))
        if "mirror" in what:
            plane("mirror", 1.0, (0.5, 0.0, 0.5), (0.0, -0.5 * math.pi, 0.0), shader)
            lamp("AREA", 50.0, location=(-2.0, 0.0, 1.5), turn=(0.0, -1.0, 0.0), size=0.6)
        else:
            if "absorbs" in what:
                absorb(shader, (0.9, 0.5, 0.1, 1.0), 3.0)
            bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.4), scale=(6.0, 6.0, 0.2))
            bpy.context.object.data.materials.append(shader)
            lamp("AREA", 50.0, size=1.0)
        compare(addon, what, floor)


def main():
    addon = addon_setup.install(*sys.argv[1:3])
    rows(addon)
    special_rows(addon)
    lamps(addon)
    world(addon)
    through(addon)
    addon_setup.finish()


main()
