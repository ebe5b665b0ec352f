# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider that feels live: where a setting changes after a run, the same surface is remeshed again; the worker still has it.
First comes a draft, and once nothing has changed for a while the full run."""
import time

import bpy

from . import state

SETTLE_S = 0.12  # a slider that moved this long ago stands still
REST_S = 0.6  # so long after a draft the full run begins

_changed_at = None


def settings_changed(settings, context):
    global _changed_at
    if not settings.is_live or bpy.app.background:
        return
    obj = context.active_object if hasattr(context, "active_object") else None
    if state.running is None and (obj is None or obj.type != "MESH" or obj.data.name not in state.sources):
        return
    is_waiting = _changed_at is not None
    _changed_at = time.monotonic()
    if not is_waiting:
        bpy.app.timers.register(_settle, first_interval=SETTLE_S)


def is_waiting():
    """Whether a run is still to begin by itself."""
    return _changed_at is not None or bpy.app.timers.is_registered(_complete)


def _run(is_draft):
    manager = bpy.context.window_manager
    if not manager.windows:
        return
    window = manager.windows[0]
    area = next((a for a in window.screen.areas if a.type == "VIEW_3D"), window.screen.areas[0])
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.object.quadwright_remesh("INVOKE_DEFAULT", is_draft=is_draft)


def _complete():
    if _changed_at is not None or not bpy.context.scene.quadwright.is_live:
        return None  # another draft comes first
    if state.running is not None:
        return REST_S
    _run(is_draft=False)
    return None


def _settle():
    global _changed_at
    left = _changed_at + SETTLE_S - time.monotonic()
    if left > 0:
        return left
    if state.running is not None:
        state.running.cancel()  # its operator leaves at the next tick
        return 0.05
    _changed_at = None
    _run(is_draft=True)
    if not bpy.app.timers.is_registered(_complete):
        bpy.app.timers.register(_complete, first_interval=REST_S)
    return None
