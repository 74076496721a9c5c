"""The panels: of renders and of materials."""

import textwrap

import bpy

from . import bake


class NEPHROID_PT_render(bpy.types.Panel):
    bl_label = "Caustics"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"

    def draw(self, context):
        layout, settings = self.layout, context.scene.nephroid
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.enabled = bake.running is None
        for name in ("preset", "layers", "map_size", "lamps", "objects", "world"):
            column.prop(settings, name)
        if bake.running is None:
            layout.operator("nephroid.bake", icon="LIGHT_POINT")
        else:
            row = layout.row(align=True)
            row.progress(factor=bake.running.share, text=bake.running.stage.title())
            row.operator("nephroid.cancel", text="", icon="CANCEL")
        row = layout.row(align=True)
        row.operator("nephroid.remove", icon="TRASH")
        row.operator("nephroid.live", icon="HIDE_OFF", depress=bake.live is not None)
        # Characters in a line of a message.
        width = max(20, int(context.region.width / 8)) if context.region else 60
        for message in context.window_manager.nephroid_messages:
            box = layout.box().column(align=True)
            box.alert = message.level == "ERROR"
            if message.object:
                box.operator("nephroid.select", text=message.object, icon="RESTRICT_SELECT_OFF").name = message.object
            for number, line in enumerate(textwrap.wrap(message.text, width)):
                box.label(text=line, icon="NONE" if number or message.object else "ERROR")


class NEPHROID_PT_material(bpy.types.Panel):
    bl_label = "Caustics"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.material is not None

    def draw(self, context):
        self.layout.use_property_split = True
        for name in ("glass", "metal", "is_thin"):
            self.layout.prop(context.material.nephroid, name)


CLASSES = (NEPHROID_PT_render, NEPHROID_PT_material)
