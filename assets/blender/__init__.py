"""Caustics of glass, mirrors and water as light maps: Blender's side of the program nephroid."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, PointerProperty, StringProperty

from . import bake, panel


class NephroidPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(name="Program", subtype="FILE_PATH",
                            description="The program nephroid; empty takes the one that came along")

    def draw(self, context):
        self.layout.prop(self, "program")


class NephroidSettings(bpy.types.PropertyGroup):
    preset: EnumProperty(name="Quality", items=[
        ("DRAFT", "Draft", "10 % of visible error"), ("PREVIEW", "Preview", "3 % of visible error"),
        ("FINAL", "Final", "1 % of visible error")])
    layers: EnumProperty(name="Light", default="CAUSTIC", items=[
        ("CAUSTIC", "Caustics", "Light that met glass, mirrors or water; Blender's lamps light the rest"),
        ("ALL", "All Light", "Caustics, direct and indirect light; the surfaces show nothing else")])
    map_size: EnumProperty(name="Map Size", items=[
        ("AUTO", "As Fine as the Light", "Up to 4096 texels a side")] + [
        (str(size), str(size), f"{size} × {size} texels on every surface, however small")
        for size in (128, 256, 512, 1024, 2048, 4096)])
    lamps: PointerProperty(name="Lamps", type=bpy.types.Collection,
                           description="Only lamps of this collection; empty takes all")
    objects: PointerProperty(name="Objects", type=bpy.types.Collection,
                             description="Only objects of this collection; empty takes all")
    world: EnumProperty(name="World", default="AUTO", items=[
        ("AUTO", "If It Has an Image", "Images and skies shine through glass, a plain colour does not"),
        ("ON", "Shines", "The world is a lamp as well"), ("OFF", "Dark", "The world throws no caustics")])


class NephroidMaterial(bpy.types.PropertyGroup):
    is_thin: BoolProperty(name="Thin Wall", description="A window or a bubble: light goes straight through, "
                          "whether the mesh is closed or not")
    glass: StringProperty(name="Glass", description="Name in the catalogue, such as N-BK7, water or diamond: its index "
                          "and dispersion replace the material's")
    metal: EnumProperty(name="Metal", default="NONE", items=[("NONE", "By Its Colour", "")] + [
        (name.upper(), name.title(), f"Measured reflectance of {name}")
        for name in ("gold", "silver", "copper", "aluminium")])


class NephroidMessage(bpy.types.PropertyGroup):
    level: StringProperty()
    object: StringProperty()
    text: StringProperty()


register_classes, unregister_classes = bpy.utils.register_classes_factory((
    NephroidPreferences, NephroidSettings, NephroidMaterial, NephroidMessage, *bake.CLASSES, *panel.CLASSES))


def register():
    register_classes()
    bpy.types.Scene.nephroid = PointerProperty(type=NephroidSettings)
    bpy.types.Material.nephroid = PointerProperty(type=NephroidMaterial)
    bpy.types.WindowManager.nephroid_messages = CollectionProperty(type=NephroidMessage)


def unregister():
    bake.stop()
    del bpy.types.Scene.nephroid, bpy.types.Material.nephroid, bpy.types.WindowManager.nephroid_messages
    unregister_classes()
