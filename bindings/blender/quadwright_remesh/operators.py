# SPDX-License-Identifier: GPL-3.0-or-later
"""Object > Quick Remesh to Quads: modal in a window, waiting in scripts."""
import time

import bpy

from . import job, state
from . import settings as settings_module
from .snapshot import Refusal

IDLE_S = 0.005  # between two looks at the worker, in scripts
TICK_S = 0.04  # and in a window
SAY_S = 0.25  # between two texts in the header, so that drawing them takes nothing from Esc


def _say(context, text):
    """In the header of the 3D views and in the status bar; None: what is usual there."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.header_text_set(text)
    if context.workspace:
        context.workspace.status_text_set(text)


def _redraw(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _sentence(text):
    return text[0].upper() + text[1:] if text else text


# Settings that Adjust Last Operation (F9) shows, and that a script may give: bpy.ops.object.quadwright_remesh(faces=500).
ADJUSTED = ("target", "faces", "edge_length", "ratio", "symmetry", "follow", "adaptive")


def _adjusted():
    """Properties of the operator like those of the scene; not remembered, as each run begins with the scene's."""
    made = {}
    for name in ADJUSTED:
        deferred = settings_module.Settings.__annotations__[name]
        made[name] = deferred.function(**{key: value for key, value in deferred.keywords.items() if key != "update"}, options={"SKIP_SAVE"})
    return made


class OBJECT_OT_quadwright_remesh(bpy.types.Operator):
    """Make clean quads of the selected meshes. Esc cancels"""

    bl_idname = "object.quadwright_remesh"
    bl_label = "Quick Remesh to Quads"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = _adjusted()
    __annotations__["is_draft"] = bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Leave out what a first look can do without")

    def _adopt(self, context):
        """What was given becomes the scene's setting; what was not shows that."""
        settings = context.scene.quadwright
        if self.properties.is_property_set("faces") and not self.properties.is_property_set("target"):
            self.target = "FACES"
        for name in ADJUSTED:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
            elif getattr(settings, name) != getattr(self, name):
                setattr(settings, name, getattr(self, name))

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "target")
        if self.target != "AUTO":
            layout.prop(self, {"FACES": "faces", "EDGE": "edge_length", "RATIO": "ratio"}[self.target])
        for name in ("symmetry", "follow", "adaptive"):
            layout.prop(self, name)

    def _begin(self, context):
        """A Job, or None with the sentence said."""
        if state.running is not None:  # no poll(): a button under the mouse would stay grey afterwards
            self.report({"WARNING"}, "Quads are being made already; Esc cancels that")
            return None
        self._adopt(context)
        objects = list(context.selected_objects)
        if context.mode != "OBJECT" and context.active_object:
            objects = list(getattr(context, "objects_in_mode", None) or [context.active_object])
        if not objects and context.active_object:
            objects = [context.active_object]
        try:
            return job.Job(context, objects, context.scene.quadwright, is_draft=self.is_draft)
        except Refusal as refusal:
            self._refuse(str(refusal))
            return None

    def _refuse(self, text):
        state.message = _sentence(text)
        self.report({"WARNING" if self.is_modal else "ERROR"}, state.message)

    def _end(self, context):
        """Writes the quads: {'FINISHED'} where some were made, else {'CANCELLED'}."""
        done, failures = self.job.finish(context)
        if not done:
            self._refuse("; ".join(failures))
            return {"CANCELLED"}
        total = sum(done.values())
        state.message = ("draft: " if self.is_draft else "") + f"{total:,} quads" + (f" of {len(done)} objects" if len(done) > 1 else "")
        if failures:
            state.message += "; " + "; ".join(failures)
        self.report({"WARNING" if failures else "INFO"}, _sentence(state.message))
        _redraw(context)
        return {"FINISHED"}

    is_modal = False

    def execute(self, context):
        self.is_modal = False
        self.job = self._begin(context)
        if self.job is None:
            return {"CANCELLED"}
        state.running = self.job
        try:
            while not self.job.is_over:
                self.job.step()
                time.sleep(IDLE_S)
            return self._end(context)
        except KeyboardInterrupt:
            self.job.cancel()
            self._refuse("cancelled; nothing was changed")
            return {"CANCELLED"}
        finally:
            state.running = None

    def invoke(self, context, event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self.is_modal, self.said, self.say_at = True, None, 0.0
        self.job = self._begin(context)
        if self.job is None:
            return {"CANCELLED"}
        state.running = self.job
        self.timer = context.window_manager.event_timer_add(TICK_S, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._progress(context)
        return {"RUNNING_MODAL"}

    def _progress(self, context):
        text = f"Quick Remesh to Quads: {100 * self.job.fraction:.0f} %, {self.job.stage}    (Esc cancels)"
        if text != self.said and time.monotonic() >= self.say_at:
            self.said, self.say_at = text, time.monotonic() + SAY_S
            _say(context, text)
            _redraw(context)

    def _leave(self, context):
        state.running = None
        if self.timer is not None:
            context.window_manager.event_timer_remove(self.timer)
            self.timer = None
        _say(context, None)
        _redraw(context)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS" or self.job.is_cancelled:
            superseded = self.job.is_cancelled
            if not superseded:
                self.job.cancel()
                state.message = "Cancelled; nothing was changed"
                self.report({"INFO"}, state.message)
            self._leave(context)
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            self.job.step()
            if not self.job.is_over:
                self._progress(context)
                return {"PASS_THROUGH"}
            result = self._end(context)
        except Exception:
            self.job.cancel()
            self._leave(context)
            raise
        self._leave(context)
        return result

    def cancel(self, context):
        """Blender ends, or loads another file."""
        self.job.cancel()
        self._leave(context)


class OBJECT_OT_quadwright_forget(bpy.types.Operator):
    """Let the next run begin from the quads as they are, not from the surface that they were made of"""

    bl_idname = "object.quadwright_forget"
    bl_label = "Forget the Surface"

    def execute(self, context):
        obj = context.active_object
        if obj is None or state.sources.pop(obj.data.name, None) is None:
            return {"CANCELLED"}
        return {"FINISHED"}


class OBJECT_OT_quadwright_cancel(bpy.types.Operator):
    """Stop making quads; nothing is changed"""

    bl_idname = "object.quadwright_cancel"
    bl_label = "Cancel"

    def execute(self, context):
        if state.running is None:
            return {"CANCELLED"}
        state.running.cancel()  # its operator leaves at the next tick
        state.message = "Cancelled; nothing was changed"
        return {"FINISHED"}


def _menu(self, context):
    self.layout.separator()
    self.layout.operator_context = "INVOKE_DEFAULT"
    self.layout.operator(OBJECT_OT_quadwright_remesh.bl_idname, icon="MESH_GRID")


classes = (OBJECT_OT_quadwright_remesh, OBJECT_OT_quadwright_forget, OBJECT_OT_quadwright_cancel)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_MT_object.append(_menu)


def unregister():
    bpy.types.VIEW3D_MT_object.remove(_menu)
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
