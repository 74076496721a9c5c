"""A .glb as Blender shows its floor, or the maps of a sequence on a plane: emission alone, straight from above. Writes
linear pixels as .npy, frame by frame where there are several.

Arguments: FILE.glb OUT.npy NAMES x0,z0,x1,z1 SIDE, or the first FILE.exr and FRAMES after them
"""

import sys

import bpy
import numpy


def add_plane(name, file, frames, area):
    """A plane that emits the images of a sequence, as an artist puts them there."""
    x0, z0, x1, z1 = area
    bpy.ops.mesh.primitive_plane_add(size=x1 - x0, location=(0.5 * (x0 + x1), -0.5 * (z0 + z1), 0.0))
    plane = bpy.context.object
    plane.name = name
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(file)
    texture.image.source = "SEQUENCE"
    texture.image.colorspace_settings.name = "Non-Color"
    texture.extension = "EXTEND"
    texture.image_user.frame_duration = frames
    texture.image_user.use_auto_refresh = True
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    links.new(texture.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    plane.data.materials.append(material)


def main():
    file, out, names, area, side = sys.argv[1:6]
    frames = int(sys.argv[6]) if len(sys.argv) > 6 else 1
    names, side = names.split(","), int(side)
    x0, z0, x1, z1 = area = [float(value) for value in area.split(",")]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if file.endswith(".exr"):
        add_plane(names[0], file, frames, area)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    for item in bpy.data.objects:
        item.hide_render = item.type == "MESH" and item.name.split(".")[0] not in names
        if item.type == "LIGHT":
            item.hide_render = True
    scene = bpy.context.scene
    lens = bpy.data.cameras.new("above")
    lens.type = "ORTHO"
    lens.ortho_scale = x1 - x0
    lens.clip_end = 300.0
    camera = bpy.data.objects.new("above", lens)
    # glTF's −z is Blender's y.
    camera.location = (0.5 * (x0 + x1), -0.5 * (z0 + z1), 100.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 144
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x = scene.render.resolution_y = side
    # A pixel is the mean over itself, and nothing of its neighbours.
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    pictures = []
    for frame in range(1, frames + 1):
        scene.frame_set(frame)
        scene.render.filepath = f"{out}{frame}.exr"
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(scene.render.filepath)
        picture.colorspace_settings.name = "Non-Color"
        pixels = numpy.array(picture.pixels[:], dtype=numpy.float64).reshape(side, side, 4)
        pictures.append(pixels[::-1, :, :3])
    numpy.save(out, pictures if frames > 1 else pictures[0])
    print(f"blender {bpy.app.version_string}")


main()
