# SPDX-License-Identifier: GPL-3.0-or-later
"""Dots at irregular vertices: blue where fewer edges than usual meet, red where more do."""
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from . import snapshot, state

FEWER, MORE = (0.15, 0.45, 1.0, 1.0), (1.0, 0.2, 0.15, 1.0)
_handle = None


def irregular(mesh):
    """(fewer, more): vertices where fewer or more edges meet than the four of the interior and the three of boundaries."""
    edges = snapshot._read(mesh.edges, "vertices", np.int32, 2)
    valence = np.bincount(edges.reshape(-1), minlength=len(mesh.vertices))
    faces = np.bincount(snapshot._read(mesh.loops, "edge_index", np.int32), minlength=len(edges))
    usual = np.full(len(mesh.vertices), 4)
    usual[edges[faces == 1].reshape(-1)] = 3
    return np.flatnonzero((valence < usual) & (valence > 0)), np.flatnonzero(valence > usual)


def _points(obj):
    """The cache: ((mesh, counts), positions of the fewer, of the more)."""
    mesh = obj.data
    key = (mesh.name, len(mesh.vertices), len(mesh.polygons))
    if state.irregular is None or state.irregular[0] != key:
        places = snapshot._read(mesh.vertices, "co", np.float32, 3)
        state.irregular = (key, *(places[which] for which in irregular(mesh)))
    return state.irregular


def _shader():
    for name in ("POINT_UNIFORM_COLOR", "UNIFORM_COLOR", "3D_UNIFORM_COLOR"):
        try:
            return gpu.shader.from_builtin(name)
        except (ValueError, TypeError):
            continue
    return None


def _draw():
    context = bpy.context
    obj = context.active_object
    if obj is None or obj.type != "MESH" or obj.mode != "OBJECT" or not context.scene.quadwright.show_irregular:
        return
    if obj.data.name not in state.reports:
        return
    shader = _shader()
    if shader is None:
        return
    _, fewer, more = _points(obj)
    gpu.state.point_size_set(6 * context.preferences.system.ui_scale)
    gpu.state.depth_test_set("LESS_EQUAL")
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.multiply_matrix(obj.matrix_world)
        projection = gpu.matrix.get_projection_matrix()
        nearer = projection.copy()
        nearer[2] = projection[2] - 2e-4 * projection[3]  # before the surface, not in it
        gpu.matrix.load_projection_matrix(nearer)
        for places, color in ((fewer, FEWER), (more, MORE)):
            if len(places):
                batch = batch_for_shader(shader, "POINTS", {"pos": places.tolist()})
                shader.bind()
                shader.uniform_float("color", color)
                batch.draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.point_size_set(1)


def register():
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
