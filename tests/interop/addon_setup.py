"""The add-on in a Blender of its own."""

import importlib
import os
import tempfile

# Before bpy is loaded: no settings of the user's are read or written.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="nephroid-blender-")

import bpy  # noqa: E402

MODULE = "bl_ext.user_default.nephroid"


def empty():
    """Nothing at all, with the add-on still on."""
    for blocks in (bpy.data.objects, bpy.data.meshes, bpy.data.curves, bpy.data.lights, bpy.data.cameras, bpy.data.materials,
                   bpy.data.images, bpy.data.node_groups, bpy.data.worlds, bpy.data.collections):
        for block in list(blocks):
            blocks.remove(block)


def install(extension, program=""):
    """Installs the extension; the package with its modules. `program` is taken instead of the one inside."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=os.path.abspath(extension), repo="user_default", enable_on_install=True)
    bpy.context.preferences.addons[MODULE].preferences.program = program
    package = importlib.import_module(MODULE)
    for name in ("bake", "lamps", "lightmaps", "materials", "panel", "scene"):
        importlib.import_module(f"{MODULE}.{name}")
    return package
