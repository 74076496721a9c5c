"""The table of Blender's nodes: each row as glTF, and the light that it makes beside Cycles'.

Arguments: EXTENSION.zip [NEPHROID] (the one inside otherwise)
"""

import json
import math
import subprocess
import sys

import addon_setup  # Before bpy.
import bpy
import numpy
import OpenEXR

# Largest difference of a mean irradiance from Cycles' [1].
BOUND = 0.03
SAMPLES = 2048
SIDE = 8

faults = []


def check(what, found, wanted, bound=1e-5):
    """Prints a comparison of numbers, lists of them or texts, and keeps those that fail."""
    numbers = numpy.asarray(wanted)
    is_right = found == wanted
    if found is not None and numbers.size and numbers.dtype.kind in "if":
        is_right = numpy.shape(found) == numbers.shape and numpy.allclose(found, numbers, rtol=bound, atol=1e-7)
    print(f"{'ok' if is_right else 'WRONG'}: {what}: {found}, {wanted} wanted")
    if not is_right:
        faults.append(what)


def material(kind, **inputs):
    """A material of one shader node, and the node."""
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader, end = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], end.inputs["Surface"])
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    return made, shader


def pick(document, path):
    """What stands in a glTF material under a path; None without it."""
    for step in path.split("/"):
        document = document.get(step) if isinstance(document, dict) else None
    return document


def rows(addon):
    """Every row of the table: the node, what its glTF has, and the words about what is lost."""
    red = (0.64, 0.25, 0.04, 1.0)
    pbr, factor = "pbrMetallicRoughness", "extensions/KHR_materials_transmission/transmissionFactor"
    volume, coat = "extensions/KHR_materials_volume", "extensions/KHR_materials_clearcoat"
    table = [
        ("BsdfPrincipled", dict(Base_Color=red, Metallic=0.0, Roughness=0.7),
         {f"{pbr}/baseColorFactor": red, f"{pbr}/roughnessFactor": 0.7, f"{pbr}/metallicFactor": 0.0, factor: None}, ""),
        ("BsdfPrincipled", dict(Metallic=1.0, Roughness=0.1), {f"{pbr}/metallicFactor": 1.0, f"{pbr}/roughnessFactor": 0.1}, ""),
        ("BsdfPrincipled", dict(Base_Color=red, Transmission_Weight=1.0, IOR=1.33, Roughness=0.2),
         {factor: 1.0, "extensions/KHR_materials_ior/ior": 1.33, f"{pbr}/roughnessFactor": 0.2,
          f"{pbr}/baseColorFactor": [0.8, 0.5, 0.2, 1.0], f"{volume}/thicknessFactor": 1.0}, ""),
        ("BsdfPrincipled", dict(Coat_Weight=0.5, Coat_Roughness=0.1),
         {f"{coat}/clearcoatFactor": 0.5, f"{coat}/clearcoatRoughnessFactor": 0.1}, ""),
        ("BsdfPrincipled", dict(Coat_Weight=0.5, Coat_IOR=2.0), {f"{coat}/clearcoatFactor": 0.5},
         "its coat was read with an index of 1.5"),
        ("BsdfPrincipled", dict(Specular_IOR_Level=0.25), {"extensions/KHR_materials_specular/specularFactor": 0.5}, ""),
        ("BsdfPrincipled", dict(Alpha=0.25), {"alphaMode": "BLEND", f"{pbr}/baseColorFactor": [0.8, 0.8, 0.8, 0.25]}, ""),
        ("BsdfPrincipled", dict(Emission_Color=(2.0, 1.0, 0.5, 1.0), Emission_Strength=3.0),
         {"emissiveFactor": [1.0, 0.5, 0.25], "extensions/KHR_materials_emissive_strength/emissiveStrength": 6.0 * 683.0}, ""),
        ("BsdfPrincipled", dict(Sheen_Weight=1.0), {}, "its Sheen Weight was ignored"),
        ("BsdfPrincipled", dict(Thin_Film_Thickness=300.0), {}, "its Thin Film Thickness was ignored"),
        ("BsdfGlass", dict(Color=red, Roughness=0.0, IOR=1.6),
         {factor: 1.0, f"{pbr}/baseColorFactor": red, f"{pbr}/roughnessFactor": 0.0,
          "extensions/KHR_materials_ior/ior": 1.6}, ""),
        ("BsdfRefraction", dict(IOR=1.4), {factor: 1.0, "extensions/KHR_materials_ior/ior": 1.4},
         "its Refraction BSDF was read as glass, which reflects as well"),
        ("BsdfAnisotropic", dict(Color=red, Roughness=0.05),
         {f"{pbr}/metallicFactor": 1.0, f"{pbr}/baseColorFactor": red, f"{pbr}/roughnessFactor": 0.05}, ""),
        ("BsdfDiffuse", dict(Color=red),
         {f"{pbr}/metallicFactor": 0.0, f"{pbr}/roughnessFactor": 1.0, f"{pbr}/baseColorFactor": red}, ""),
        ("BsdfTransparent", {}, {"alphaMode": "BLEND", f"{pbr}/baseColorFactor": [0.0, 0.0, 0.0, 0.0]}, ""),
        ("BsdfTranslucent", dict(Color=red), {f"{pbr}/baseColorFactor": red},
         "its Translucent BSDF was read as matte: no light goes through"),
        ("SubsurfaceScattering", dict(Color=red), {f"{pbr}/baseColorFactor": red},
         "its Subsurface Scattering was read as matte: no light goes through"),
        ("BsdfSheen", dict(Color=red), {f"{pbr}/baseColorFactor": red}, "its Sheen BSDF was read as matte"),
        ("BsdfToon", dict(Color=red), {f"{pbr}/baseColorFactor": red}, "its Toon BSDF was read as matte"),
        ("Emission", dict(Color=(1.0, 0.5, 0.0, 1.0), Strength=2.0),
         {"emissiveFactor": [1.0, 0.5, 0.0], "extensions/KHR_materials_emissive_strength/emissiveStrength": 2.0 * 683.0}, ""),
        ("BsdfHair", {}, {}, "its shader Hair BSDF is not read; it was baked as matte"),
    ]
    if hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        table.append(("BsdfMetallic", dict(Base_Color=red, Roughness=0.0),
                      {f"{pbr}/metallicFactor": 1.0, f"{pbr}/baseColorFactor": red}, ""))
    tested = set()
    for kind, inputs, wanted, word in table:
        made, node = material(kind, **inputs)
        if node.type == "BSDF_METALLIC":
            node.fresnel_type = "F82"
        tested.add(node.type)
        surface = addon.materials.Surface(made)
        document = surface.gltf(lambda node: {"index": 0})
        name = f"{kind} {' '.join(inputs)}"
        for path, value in wanted.items():
            check(f"{name}: {path}", pick(document, path), value)
        check(f"{name}: words", "; ".join(surface.faults), word)
    missing = {"BSDF_METALLIC"} if not hasattr(bpy.types, "ShaderNodeBsdfMetallic") else set()
    check("rows without a test", sorted(set(addon.materials.NODES) - tested - missing), [])


def special_rows(addon):
    """What is not a node's own: volumes, thin walls, glasses, mixtures, images."""
    made, glass = material("BsdfGlass")
    absorbs = made.node_tree.nodes.new("ShaderNodeVolumeAbsorption")
    absorbs.inputs["Color"].default_value, absorbs.inputs["Density"].default_value = (0.9, 0.5, 0.1, 1.0), 4.0
    end = addon.materials.output(made)
    made.node_tree.links.new(absorbs.outputs[0], end.inputs["Volume"])

    def read():
        surface = addon.materials.Surface(made)
        return surface.gltf(lambda node: {"index": node.image.name}), surface.faults

    stated = read()[0]["extensions"]["KHR_materials_volume"]
    distance, colour = stated["attenuationDistance"], numpy.array(stated["attenuationColor"])
    check("Volume Absorption after 0.3 m", (colour ** (0.3 / distance)).tolist(),
          [math.exp(-4.0 * (1 - c) * 0.3) for c in (0.9, 0.5, 0.1)])
    made.nephroid.is_thin, made.nephroid.glass = True, "N-BK7"
    made["metal"] = "gold"
    check("thin wall", read()[0]["extensions"]["KHR_materials_volume"]["thicknessFactor"], 0.0)
    check("glass by name and a custom property", read()[0]["extras"], {"metal": "gold", "glass": "N-BK7"})

    made, shader = material("BsdfGlass", IOR=1.7)
    tree, end = made.node_tree, addon.materials.output(made)
    mix, clear, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "BsdfTransparent", "LightPath"))
    tree.links.new(path.outputs["Is Shadow Ray"], mix.inputs[0])
    tree.links.new(shader.outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], end.inputs["Surface"])
    check("glass with shadows of light", read()[0]["extensions"]["KHR_materials_ior"]["ior"], 1.7)
    tree.links.remove(mix.inputs[0].links[0])
    mix.inputs[0].default_value = 0.3
    check("part of a Transparent BSDF", read()[0]["pbrMetallicRoughness"]["baseColorFactor"][3], 0.7)

    made, shader = material("BsdfPrincipled")
    tree = made.node_tree
    picture, mapping, noise = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Mapping", "TexNoise"))
    picture.image = bpy.data.images.new("wood", 4, 4)
    tree.links.new(picture.outputs["Color"], shader.inputs["Base Color"])
    check("image as colour", read()[0]["pbrMetallicRoughness"]["baseColorTexture"], {"index": "wood"})
    tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    check("nodes that are not read", read()[1], ["the nodes at its Roughness are not read; its default was baked"])


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
    scene.render.engine, scene.cycles.samples = "CYCLES", SAMPLES
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0
    scene.render.bake.margin = 0
    tree = item.data.materials[0].node_tree
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image, tree.nodes.active = image, target
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item.select_set(True)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    pixels = numpy.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    tree.nodes.remove(target)
    bpy.data.images.remove(image)
    return math.pi * pixels.mean(axis=0)


def by_nephroid(addon, names):
    """Mean irradiances of planes as the program bakes what the add-on exports [W/m²]."""
    files = addon.bake.Files(bpy.context)
    maps = files.folder / "maps"
    world = ["--environment", str(files.world)] if files.has_world else []
    subprocess.run([addon.bake.program(), "bake", str(files.scene), "-o", str(maps), "--layers", "caustic,direct",
                    "--quiet", "--map-resolution", str(4 * SIDE), "--max-error", "1%", "--solid-glass=off", *world],
                   check=True, stdout=subprocess.DEVNULL)
    manifest = json.loads((maps / "manifest.json").read_text())
    means = {name: numpy.zeros(3) for name in names}
    for entry in manifest["maps"]:
        if entry["surface"] in means and entry["side"] == "front":
            channels = OpenEXR.File(str(maps / entry["file"]), separate_channels=True).parts[0].channels
            means[entry["surface"]] = numpy.array([channels[name].pixels.mean() for name in "RGB"])
    files.remove()
    return [means[name] for name in names]


def compare(addon, what, *items):
    """Irradiances of planes, beside Cycles'."""
    ours = by_nephroid(addon, [item.name for item in items])
    for item, found in zip(items, ours):
        check(f"{what}: W/m² on {item.name}, beside Cycles", found.round(4).tolist(), by_cycles(item).round(4).tolist(), BOUND)


def empty():
    addon_setup.empty()
    bpy.context.scene.cycles.max_bounces = 12


def lamp(kind, energy, location=(0.0, 0.0, 2.0), turn=(0.0, 0.0, 0.0), **values):
    bpy.ops.object.light_add(type=kind, location=location, rotation=turn)
    data = bpy.context.object.data
    data.energy = energy
    for name, value in values.items():
        if hasattr(data, name):
            setattr(data, name, value)
    return bpy.context.object


def lamps(addon):
    """Every kind of lamp, over a floor."""
    tilt = (0.4, 0.2, 0.0)
    for what, arguments in {
        "sun": dict(kind="SUN", energy=3.0, turn=tilt, angle=0.2),
        "sun with exposure and colour": dict(kind="SUN", energy=3.0, turn=tilt, angle=0.0, exposure=1.0, color=(1.0, 0.5, 0.25)),
        "point": dict(kind="POINT", energy=100.0, shadow_soft_size=0.1),
        "point by temperature": dict(kind="POINT", energy=100.0, shadow_soft_size=0.05, use_temperature=True, temperature=3000.0),
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
    pixels = numpy.full((32, 64, 4), 0.1, dtype=numpy.float32)
    pixels[18:26, 8:20, :3] = (5.0, 2.0, 1.0)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    sky = bpy.data.worlds.new("sky")
    sky.use_nodes = True
    tree = sky.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 2.0
    picture, mapping, coordinates = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord"))
    picture.image = image
    mapping.inputs["Rotation"].default_value[2] = 0.6
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])
    bpy.context.scene.world = sky
    right = 0.5 * math.pi
    compare(addon, "world", plane("up", 1.0, (0.0, 0.0, 0.0)), plane("east", 1.0, (9.0, 0.0, 0.0), (0.0, right, 0.0)),
            plane("south", 1.0, (0.0, -9.0, 0.0), (right, 0.0, 0.0)))


def through(addon):
    """Floors under slabs and beside mirrors."""
    tint = (0.64, 0.36, 0.16, 1.0)
    absorbing, _ = material("BsdfGlass", IOR=1.5)
    volume = absorbing.node_tree.nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Color"].default_value, volume.inputs["Density"].default_value = (0.9, 0.5, 0.1, 1.0), 3.0
    absorbing.node_tree.links.new(volume.outputs[0], addon.materials.output(absorbing).inputs["Volume"])
    for what, shader in {
        "slab of Principled": material("BsdfPrincipled", Base_Color=tint, Transmission_Weight=1.0, Roughness=0.0, IOR=1.45)[0],
        "slab of frosted Principled": material("BsdfPrincipled", Base_Color=(1, 1, 1, 1), Transmission_Weight=1.0, Roughness=0.4)[0],
        "slab of Glass": material("BsdfGlass", Color=tint, IOR=1.6)[0],
        "slab that absorbs": absorbing,
    }.items():
        empty_keeping(shader)
        floor = plane("floor", 1.0, (0.0, 0.0, 0.0))
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.4))
        slab = bpy.context.object
        slab.scale = (6.0, 6.0, 0.2)
        slab.data.materials.append(shader)
        lamp("AREA", 50.0, size=1.0)
        compare(addon, what, floor)
    for what, shader in {
        "mirror of Glossy": material("BsdfAnisotropic", Color=tint, Roughness=0.0)[0],
        "rough mirror of Principled": material("BsdfPrincipled", Base_Color=tint, Metallic=1.0, Roughness=0.3)[0],
    }.items():
        empty_keeping(shader)
        floor = plane("floor", 1.0, (0.0, 0.0, 0.0))
        plane("mirror", 1.0, (0.5, 0.0, 0.5), (0.0, -0.5 * math.pi, 0.0), shader)
        lamp("AREA", 50.0, location=(-2.0, 0.0, 1.5), turn=(0.0, -1.0, 0.0), size=0.6)
        compare(addon, what, floor)


def empty_keeping(shader):
    """A new scene with a material of the last one."""
    scene = bpy.context.scene
    for item in list(scene.objects):
        bpy.data.objects.remove(item)
    scene.world = None


def main():
    addon = addon_setup.install(*sys.argv[1:3])
    rows(addon)
    special_rows(addon)
    lamps(addon)
    world(addon)
    empty()
    through(addon)
    if faults:
        sys.exit("addon_nodes: " + "; ".join(faults))


main()
