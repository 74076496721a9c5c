"""A .glb as Blender shows its floor: emission alone, straight from above. Writes linear pixels as .npy.

Arguments: FILE.glb OUT.npy NAMES x0,z0,x1,z1 SIDE
"""

import sys

import bpy
import numpy


def main():
    file, out, names, area, side = sys.argv[1:6]
    names, side = names.split(","), int(side)
    x0, z0, x1, z1 = (float(value) for value in area.split(","))
    bpy.ops.wm.read_factory_settings(use_empty=True)
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
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x = scene.render.resolution_y = side
    # A pixel is the mean over itself, and nothing of its neighbours.
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = out + ".exr"
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(out + ".exr")
    picture.colorspace_settings.name = "Non-Color"
    pixels = numpy.array(picture.pixels[:], dtype=numpy.float64).reshape(side, side, 4)
    numpy.save(out, pixels[::-1, :, :3])
    print(f"blender {bpy.app.version_string}")


main()
