# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the sidebar of the 3D view."""
import bpy

from . import settings as settings_module
from . import snapshot, state


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Quads"

    @classmethod
    def poll(cls, context):
        return context.active_object is not None


def _wrapped(layout, text, icon, width):
    """Sentences over several lines, as labels don't wrap."""
    line, first = "", True
    for word in text.split(" "):
        if line and len(line) + 1 + len(word) > width:
            layout.label(text=line, icon=icon if first else "BLANK1")
            line, first = word, False
        else:
            line = f"{line} {word}" if line else word
    layout.label(text=line, icon=icon if first else "BLANK1")


def _width(context):
    return max(20, int(context.region.width / (7.2 * context.preferences.system.ui_scale)) - 8)


class QUADWRIGHT_PT_main(_Panel, bpy.types.Panel):
    bl_label = "Quick Remesh to Quads"
    bl_idname = "QUADWRIGHT_PT_main"

    def draw(self, context):
        layout, settings, obj = self.layout, context.scene.quadwright, context.active_object
        layout.use_property_split = True
        layout.use_property_decorate = False
        row = layout.row()
        row.scale_y = 1.4
        row.operator_context = "INVOKE_DEFAULT"
        row.operator("object.quadwright_remesh", text="Remesh to Quads", icon="MESH_GRID")
        if state.running is not None:
            at_work = state.running
            row = layout.row(align=True)
            if hasattr(row, "progress"):  # Blender 4.0 and later
                row.progress(factor=at_work.fraction, text=f"{100 * at_work.fraction:.0f} %, {at_work.stage}")
            else:
                row.label(text=f"{100 * at_work.fraction:.0f} %, {at_work.stage}", icon="TIME")
            row.operator("object.quadwright_cancel", text="", icon="CANCEL")
        elif state.message:
            _wrapped(layout.column(align=True), state.message, "INFO", _width(context))
        if context.mode == "EDIT_MESH":
            column = layout.column()
            column.use_property_split = False
            column.prop(settings, "selected_only")
        source = state.sources.get(obj.data.name) if obj.type == "MESH" else None
        if source is not None:
            column = layout.column(align=True)
            column.label(text=f"Again from {len(source[0].sizes):,} faces", icon="FILE_REFRESH")
            row = column.row(align=True)
            row.use_property_split = False
            row.prop(settings, "is_live", toggle=True)
            row.operator("object.quadwright_forget", text="", icon="X")
        if obj.type != "MESH":
            _wrapped(layout.column(align=True), snapshot.no_mesh(obj), "ERROR", _width(context))
        column = layout.column()
        column.prop(settings, "target")
        if settings.target != "AUTO":
            column.prop(settings, {"FACES": "faces", "EDGE": "edge_length", "RATIO": "ratio"}[settings.target])
        elif obj.type == "MESH":
            column.label(text=f"About {settings_module.automatic(obj, context, settings):,} quads", icon="BLANK1")
        column.prop(settings, "preset")
        column.prop(settings, "symmetry")


class _Folded(_Panel):
    bl_parent_id = "QUADWRIGHT_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.fill(layout.column(), context.scene.quadwright, context.active_object)


def _choices(column, settings, name, title):
    column.label(text=title)
    row = column.grid_flow(columns=2, align=True)
    row.use_property_split = False
    row.prop(settings, name)


class QUADWRIGHT_PT_shape(_Folded, bpy.types.Panel):
    bl_label = "Shape and Size"
    bl_idname = "QUADWRIGHT_PT_shape"

    def fill(self, column, settings, obj):
        column.prop(settings, "follow", slider=True)
        column.prop(settings, "density")
        if settings.density == "CURVATURE":
            column.prop(settings, "adaptive", slider=True)
        elif settings.density == "GROUP":
            column.prop_search(settings, "density_group", obj, "vertex_groups", text="Group") if obj.type == "MESH" else None
            column.prop(settings, "contrast")
        elif settings.density == "COLOR":
            column.prop_search(settings, "density_color", obj.data, "color_attributes", text="Color") if obj.type == "MESH" else None
            column.prop(settings, "contrast")
        column.prop(settings, "sharp")
        if settings.sharp == "ANGLE":
            column.prop(settings, "angle")
        _choices(column, settings, "marks", "Follow Marked Edges")
        column.prop(settings, "guides")
        if settings.guides == "CURVE":
            column.prop(settings, "guide_curve")
        if settings.guides != "NONE":
            column.prop(settings, "guide_kind")
            if settings.guide_kind == "LOOP":
                column.prop(settings, "guide_rings")


class QUADWRIGHT_PT_surface(_Folded, bpy.types.Panel):
    bl_label = "Surface and Levels"
    bl_idname = "QUADWRIGHT_PT_surface"

    def fill(self, column, settings, obj):
        column.prop(settings, "option_wrap")
        if settings.option_wrap:
            column.prop(settings, "option_wrap_distance")
            if settings.option_wrap_distance == 0:
                column.prop(settings, "option_wrap_quads")
        column.prop(settings, "lods")
        column.prop(settings, "apply_modifiers")


class QUADWRIGHT_PT_keep(_Folded, bpy.types.Panel):
    bl_label = "Keep, Unwrap, Bake"
    bl_idname = "QUADWRIGHT_PT_keep"

    def fill(self, column, settings, obj):
        _choices(column, settings, "keep", "Keep")
        column = column.column()
        column.use_property_split = False
        column.prop(settings, "bake")
        if settings.bake:
            column.prop(settings, "option_texture", text="Texels")
        else:
            column.prop(settings, "unwrap")
        column.prop(settings, "keep_original")
        column.prop(settings, "show_wires")


class QUADWRIGHT_PT_rest(_Panel, bpy.types.Panel):
    bl_label = "More Options"
    bl_idname = "QUADWRIGHT_PT_rest"
    bl_parent_id = "QUADWRIGHT_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in settings_module.REST:
            if name in ("wrap", "wrap_distance", "wrap_quads"):  # in the panel above
                continue
            layout.prop(context.scene.quadwright, "option_" + name)
            if name == "subdivide" and context.scene.quadwright.option_subdivide > 0:
                layout.prop(context.scene.quadwright, "multires")


class QUADWRIGHT_PT_report(_Panel, bpy.types.Panel):
    bl_label = "Report"
    bl_idname = "QUADWRIGHT_PT_report"
    bl_parent_id = "QUADWRIGHT_PT_main"

    @classmethod
    def poll(cls, context):
        obj = context.active_object
        return obj is not None and obj.type == "MESH" and obj.data.name in state.reports

    def draw(self, context):
        layout, mesh = self.layout, context.active_object.data
        made, lines, counts = state.reports[mesh.name]
        if counts != (len(mesh.vertices), len(mesh.polygons)):
            layout.label(text="The mesh changed since", icon="INFO")
            return
        column = layout.column(align=True)
        for icon, sentence in lines:
            _wrapped(column, sentence, icon, _width(context))
        layout.prop(context.scene.quadwright, "show_irregular")


classes = (QUADWRIGHT_PT_main, QUADWRIGHT_PT_report, QUADWRIGHT_PT_shape, QUADWRIGHT_PT_surface, QUADWRIGHT_PT_keep, QUADWRIGHT_PT_rest)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
