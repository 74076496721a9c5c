"""The add-on in a Blender of its own, and what its tests share."""

import importlib
import os
import sys
import tempfile

# Before bpy is loaded: no settings of the user's are read or written.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="nephroid-blender-")

import bpy  # noqa: E402
import numpy  # noqa: E402

MODULE = "bl_ext.user_default.nephroid"

faults = []


def install(extension, program=""):
    """Installs the extension; the package with its modules. `program` is taken instead of the one inside."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=os.path.abspath(extension), repo="user_default", enable_on_install=True)
    bpy.context.preferences.addons[MODULE].preferences.program = program
    return importlib.import_module(MODULE)


def empty():
    """Nothing at all, with the add-on still on."""
    bpy.ops.wm.read_homefile(use_empty=True)


def check(what, is_right, told=""):
    """Prints an outcome, and keeps those that fail."""
    print(f"{'ok' if is_right else 'WRONG'}: {what} {told}", flush=True)
    if not is_right:
        faults.append(what)


def finish():
    if faults:
        sys.exit(f"{sys.argv[0]}: " + "; ".join(faults))


def material(kind, name=None, **inputs):
    """A material of one shader node, and the node."""
    made = bpy.data.materials.new(name or kind)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader, end = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], end.inputs["Surface"])
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made, shader


def absorb(made, color, density):
    """Gives a material a Volume Absorption [1/m]."""
    node, end = made.node_tree.nodes.new("ShaderNodeVolumeAbsorption"), made.node_tree.get_output_node("ALL")
    node.inputs["Color"].default_value, node.inputs["Density"].default_value = color, density
    made.node_tree.links.new(node.outputs[0], end.inputs["Volume"])


def pixels(path):
    """An image file as stored: [height, width, 3], bottom row first."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = numpy.array(image.pixels[:]).reshape(image.size[1], image.size[0], -1)[..., :3]
    bpy.data.images.remove(image)
    return values
