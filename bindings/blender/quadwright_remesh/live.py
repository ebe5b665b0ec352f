# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider that feels live: where a setting changes after a run, the same surface is remeshed again; the worker still has it."""
import time

import bpy

from . import state

SETTLE_S = 0.12  # a slider that moved this long ago stands still

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


def _settle():
    global _changed_at
    left = _changed_at + SETTLE_S - time.monotonic()
    if left > 0:
        return left
    if state.running is not None:
        state.running.cancel()  # its operator leaves at the next tick
        return 0.05
    _changed_at = None
    manager = bpy.context.window_manager
    if not manager.windows:
        return None
    window = manager.windows[0]
    area = next((a for a in window.screen.areas if a.type == "VIEW_3D"), window.screen.areas[0])
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.object.quadwright_remesh("INVOKE_DEFAULT")
    return None
