"""Blender's Cycles bakes the floor: the light on it from the casters, path traced or by manifold next-event estimation.

Usage: blender.py SCENE.glb FOLDER BUDGET_S SIDE paths|mnee

Cycles carries radiance into water without the factor n² by which it grows there. A floor under water is multiplied by it
here, by hand.
"""

import math
import sys

import bpy
import numpy
from mathutils import Vector

import scene as scenes
import steps

BOUNCES = 18
DIRECT_SAMPLES = 64


def blender(vectors):
    """glTF's (x, y, z), y up, as Blender's, z up."""
    return numpy.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)


def add_mesh(name, positions, triangles, normals=None):
    """An object of triangles, with its vertex normals where there are some."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", blender(positions).astype(numpy.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.astype(numpy.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, triangles.size, 3, dtype=numpy.int32))
    mesh.update(calc_edges=True)
    if normals is not None:
        mesh.normals_split_custom_set_from_vertices(blender(normals).astype(numpy.float32))
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def add_material(item, kind, **inputs):
    """A material of one shader node."""
    material = bpy.data.materials.new(item.name)
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    item.data.materials.append(material)
    return tree, shader


def add_floor(scene, side):
    """The floor and the image that is baked. It reflects all where a bake looks at it, and sends no light on."""
    x, z, size, y = scene.x0, scene.z0, scene.side_m, scene.height_m
    corners = numpy.array([[x, y, z + size], [x + size, y, z + size], [x + size, y, z], [x, y, z]])
    floor = add_mesh("floor", corners, numpy.array([[0, 1, 2], [0, 2, 3]]))
    # Blender's rows count from below: what it stores first is v = 0, here least z.
    coordinates = numpy.array([[0, 1], [1, 1], [1, 0], [0, 1], [1, 0], [0, 0]], dtype=numpy.float32)
    floor.data.uv_layers.new().data.foreach_set("uv", coordinates.ravel())
    tree, matte = add_material(floor, "ShaderNodeBsdfDiffuse")
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], matte.inputs["Color"])
    image = bpy.data.images.new("map", side, side, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    tree.nodes.active = target
    return floor, image


def add_casters(scene):
    """What is specular."""
    for number, caster in enumerate(scene.casters):
        item = add_mesh(f"caster{number}", caster.positions, caster.triangles, caster.normals)
        white = (1.0, 1.0, 1.0, 1.0)
        if caster.ior is None:
            add_material(item, "ShaderNodeBsdfGlossy", Color=white, Roughness=0.0)
        else:
            add_material(item, "ShaderNodeBsdfGlass", Color=white, Roughness=0.0, IOR=caster.ior)
        item.cycles.is_caustics_caster = True


def add_lamp(scene, width_m):
    """The lamp, of the same watts. A sun is as wide as this looks from the casters, `distance_m` above the floor."""
    lamp = scene.lamp
    distance_m = max(caster.positions[:, 1].mean() for caster in scene.casters) - scene.height_m
    data = bpy.data.lights.new("lamp", "SUN" if lamp.is_sun else "POINT")
    if lamp.is_sun:
        data.energy = lamp.amount
        data.angle = width_m / distance_m
    else:
        data.energy = 4.0 * math.pi * lamp.amount
        data.shadow_soft_size = 0.5 * width_m
    item = bpy.data.objects.new("lamp", data)
    item.location = blender(lamp.position)
    # A sun shines along its −z.
    item.rotation_mode = "QUATERNION"
    item.rotation_quaternion = Vector(-blender(lamp.direction)).to_track_quat("Z", "Y")
    bpy.context.scene.collection.objects.link(item)
    return data


def settings():
    """Nothing that trades truth for looks: no clamp, no filter, no denoiser, no early end of paths."""
    context = bpy.context.scene
    context.render.engine = "CYCLES"
    context.render.bake.margin = 0
    context.render.bake.use_clear = True
    cycles = context.cycles
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    for name in ["max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "min_light_bounces"]:
        setattr(cycles, name, BOUNCES)
    return cycles


def main():
    file, folder, budget_s, side, way = sys.argv[1:]
    by_paths, side = way == "paths", int(side)

    # An empty file has none of the lamps and settings that Blender starts with.
    scene = scenes.read(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cycles = settings()
    floor, image = add_floor(scene, side)
    add_casters(scene)

    # Paths have to find the lamp, so that it cannot be a point: as wide as a texel, it blurs as little as the map does.
    lamp = add_lamp(scene, scene.side_m / side if by_paths else 0.0)

    floor.cycles.is_caustics_receiver = True
    bpy.context.view_layer.objects.active = floor
    floor.select_set(True)
    growth = scenes.ior_above_floor(scene) ** 2

    def bake(samples, seed, passes):
        """Irradiance of these passes [W/m²]: the light of a white floor without its colour is E/π."""
        cycles.samples, cycles.seed = samples, seed
        bpy.ops.object.bake(type="DIFFUSE", pass_filter=passes)
        pixels = numpy.empty(side * side * 4, dtype=numpy.float32)
        image.pixels.foreach_get(pixels)
        return growth * math.pi * pixels.reshape(side, side, 4)[..., :3].mean(axis=-1, dtype=numpy.float64)

    # Direct light is taken from a pass of its own, since the caustic is compared alone.
    direct = bake(DIRECT_SAMPLES, 1, {"DIRECT"})
    lamp.cycles.is_caustics_light = not by_paths

    def trace(samples, seed):
        """Without what comes straight from the lamp. (MNEE gives nothing where one of the two passes is left out.)"""
        if by_paths:
            return bake(samples, seed, {"INDIRECT"})
        return bake(samples, seed, {"DIRECT", "INDIRECT"}) - direct

    def seconds(samples):
        """CPU seconds of a bake."""
        start_s = steps.cpu_s()
        trace(samples, 4095)
        return steps.cpu_s() - start_s

    # A bake of n samples takes b + s·n seconds: two short ones tell b, the time before it samples.
    one_s, three_s = seconds(1), seconds(3)
    build_s = max(0.5 * (3.0 * one_s - three_s), 0.0)
    steps.take(folder, float(budget_s), 4, trace, pooled=True, build_s=build_s, rays_per_sample=side * side)


main()
