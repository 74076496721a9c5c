"""Blender's lamps as glTF's, watt for watt, and the world as an image."""

import math

import bpy
import numpy

from .materials import LUMENS_PER_WATT, custom_properties, number, output, source

WORLD_SIZE = (1024, 512)
# Enough to find a sun in a sky within its pixel.
WORLD_SAMPLES = 16


def strength(lamp, fault):
    """Watts (of a sun W/m²) of each channel, with exposure, temperature and a plain Emission node."""
    channels = numpy.array(lamp.color) * lamp.energy * 2.0 ** getattr(lamp, "exposure", 0.0)
    if getattr(lamp, "use_temperature", False):
        channels *= lamp.temperature_color
    end = output(lamp)
    if end is not None:
        node, _ = source(end.inputs["Surface"])
        if node is None or node.type != "EMISSION" or any(socket.is_linked for socket in node.inputs):
            fault("its nodes are not read; it was baked without them")
        else:
            channels *= numpy.array(number(node.inputs["Color"].default_value)) * node.inputs["Strength"].default_value
    return channels


def gltf(lamp, scale, fault):
    """The list that a lamp stands in, its entry there, and the extras of its node; (None, None, None) for a dark one.

    `fault(text)` is told what is lost.
    """
    # glTF states a colour of at most 1 apart from the intensity.
    channels = strength(lamp, fault)
    brightest = float(channels.max())
    if brightest <= 0.0:
        return None, None, None
    entry = {"name": lamp.name_full, "color": [max(float(channel), 0.0) / brightest for channel in channels]}
    extras, is_normalized = custom_properties(lamp), getattr(lamp, "normalize", True)

    # Suns state W/m² across their light in Blender, and lux in glTF.
    if lamp.type == "SUN":
        extras.setdefault("angular_diameter_deg", min(math.degrees(lamp.angle), 180.0))
        return "KHR_lights_punctual", dict(entry, type="directional", intensity=brightest * LUMENS_PER_WATT), extras

    # The power of a spot is that of a point lamp of the same intensity: its cone only cuts light off.
    if lamp.type in {"POINT", "SPOT"}:
        radius_m = lamp.shadow_soft_size
        extras.setdefault("radius_m", radius_m)
        power_w = brightest if is_normalized else brightest * math.pi * radius_m ** 2
        entry.update(type=lamp.type.lower(), intensity=power_w / (4.0 * math.pi) * LUMENS_PER_WATT)
        if lamp.type == "SPOT":
            outer = 0.5 * min(lamp.spot_size, math.pi)
            # glTF has no hard edge.
            entry["spot"] = {"outerConeAngle": outer, "innerConeAngle": outer * (1.0 - max(lamp.spot_blend, 1e-4))}
        return "KHR_lights_punctual", entry, extras

    # The entry takes the scale into the size of the panel, since its node only turns and moves it.
    has_sides = lamp.shape in {"RECTANGLE", "ELLIPSE"}
    width, height = lamp.size * scale[0], (lamp.size_y if has_sides else lamp.size) * scale[1]
    is_disc = lamp.shape in {"DISK", "ELLIPSE"}
    area_m2 = width * height * (0.25 * math.pi if is_disc else 1.0)
    if area_m2 <= 0.0:
        fault("has no area and was left out")
        return None, None, None
    if lamp.shape == "ELLIPSE":
        fault("is an ellipse and was baked as a disc of the same area")
    if lamp.spread < math.pi - 1e-3:
        fault("its spread was ignored; it was baked with one of 180 degrees")

    # A Lambertian panel of the power Φ and the area A has the radiance Φ/(πA).
    radiance = brightest / math.pi / (area_m2 if is_normalized else 1.0)
    kind, size, aspect = ("disk", math.sqrt(width * height), 1.0) if is_disc else ("rect", height, width / height)
    entry.update(type=kind, shape=kind, intensity=radiance * LUMENS_PER_WATT, size=size, rect={"aspect": aspect})
    return "EXT_lights_area", entry, extras


def world_shines(world, wish):
    """Whether the world's light is baked: as wished, by default where it is more than one colour."""
    if world is None or wish != "AUTO":
        return world is not None and wish == "ON"
    end = output(world)
    node = source(end.inputs["Surface"])[0] if end else None
    return node is not None and (node.type != "BACKGROUND" or node.inputs["Color"].is_linked)


def write_world(world, path):
    """Renders a world, whatever its nodes, to an equirectangular OpenEXR image whose centre lies at Blender's −y."""
    scene = bpy.data.scenes.new("Nephroid world")
    lens = bpy.data.cameras.new("Nephroid world")
    camera = bpy.data.objects.new("Nephroid world", lens)
    try:
        scene.collection.objects.link(camera)
        scene.camera, scene.world = camera, world
        lens.type = "PANO"
        (lens if hasattr(lens, "panorama_type") else lens.cycles).panorama_type = "EQUIRECTANGULAR"
        camera.rotation_euler = (math.radians(90.0), 0.0, math.radians(180.0))
        render = scene.render
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y = WORLD_SIZE
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_mode, render.image_settings.color_depth = "RGB", "32"
        render.filepath = str(path)
        scene.cycles.samples, scene.cycles.use_denoising = WORLD_SAMPLES, False
        bpy.ops.render.render(scene=scene.name, write_still=True)
    finally:
        bpy.data.batch_remove((scene, camera, lens))
