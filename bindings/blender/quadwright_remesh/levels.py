# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads that were split, as level 0 of a Multiresolution modifier and what its highest level adds."""
import bpy
import numpy as np

from .rebuild import Quads

NAME = "Multires"
PER_FACE, PER_CORNER = ("material", "smooth", "filled"), ("uv",)


def times(quads):
    """How often each quad of level 0 was split in four; 0: not at all."""
    coarse = quads.arrays.get("coarse quads")
    return 0 if coarse is None or not len(coarse) else round(np.log2(len(quads.quads) / len(coarse)) / 2)


def level_zero(quads):
    """The Quads of level 0, with what was carried over to them: their vertices are the first, and each quarter of a quad begins at its corner."""
    block, count = 4 ** times(quads), len(quads.coarse)
    corners = (4 * (block * np.arange(len(quads.quads) // block)[:, None] + block // 4 * np.arange(4))).reshape(-1)
    made = Quads.__new__(Quads)
    made.vertices, made.quads = quads.coarse, quads.arrays["coarse quads"].astype(np.int32)
    made.kept = made.kept_sizes = made.kept_from = made.still = made.still_from = np.zeros(0, np.int32)
    made.loose, made.arrays, made.has_levels = quads.loose, {}, True
    for name, array in quads.arrays.items():
        word = name.split(":", 1)[-1].split(" ")[0]
        if name == "creases":  # of level 0 already
            made.arrays[name] = array
        elif name.startswith(("a:", "g:")):
            per_corner = word in PER_CORNER or (word == "color" and len(array) == 4 * len(quads.quads))
            made.arrays[name] = array[::block] if word in PER_FACE else array[corners] if per_corner else array[:count]
    return made


def _object(context, name, mesh):
    made = bpy.data.objects.new(name, mesh)
    context.scene.collection.objects.link(made)
    return made


def _graph(context):
    graph = context.evaluated_depsgraph_get()
    graph.update()
    return graph


def _positions(context, obj):
    """float32 (n, 3): the vertices that the object's modifiers make."""
    mesh = obj.evaluated_get(_graph(context)).data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.reshape(-1))
    return found


def _grid(splits):
    """int64 (4 ** splits, 4, 2): where the corners of the quads lie that a quad becomes, of 2 ** splits steps along its sides."""
    square = np.array([[[0, 0], [1, 0], [1, 1], [0, 1]]], np.int64) << splits
    for _ in range(splits):
        middle, after, before = square.sum(1) // 4, (square + np.roll(square, -1, 1)) // 2, (square + np.roll(square, 1, 1)) // 2
        square = np.stack([np.stack([square[:, i], after[:, i], middle, before[:, i]], 1) for i in range(4)], 1).reshape(-1, 4, 2)
    return square


def _order(context, base, fine, splits):
    """int64 (n,): for each vertex of Blender's subdivision of quads, int32 (m, 4), that of the fine quads, int32 (m * 4 ** splits, 4), at the same place."""
    mesh = bpy.data.meshes.new(".levels")
    mesh.from_pydata(np.zeros((int(base.max()) + 1, 3)), [], base.tolist())
    mesh.uv_layers.new(name="place").data.foreach_set("uv", np.tile(np.float32([0, 0, 1, 0, 1, 1, 0, 1]), len(base)))
    obj = _object(context, ".levels", mesh)
    try:
        split = obj.modifiers.new("Split", "SUBSURF")
        split.subdivision_type, split.levels, split.uv_smooth = "SIMPLE", splits, "NONE"
        evaluated = obj.evaluated_get(_graph(context))
        made = evaluated.to_mesh()
        vertex, place = np.empty(len(made.loops), np.int32), np.empty(2 * len(made.loops), np.float32)
        made.loops.foreach_get("vertex_index", vertex)
        made.uv_layers[0].data.foreach_get("uv", place)
        count = len(made.vertices)
        evaluated.to_mesh_clear()
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
    side, grid = (1 << splits) + 1, _grid(splits)
    at = np.empty((len(base), side, side), np.int64)
    at[:, grid[..., 0], grid[..., 1]] = fine.reshape(len(base), -1, 4)
    steps = np.rint(place.reshape(len(base), -1, 2) * (1 << splits)).astype(np.int64)
    found = at[np.arange(len(base))[:, None], steps[..., 0], steps[..., 1]].reshape(-1)
    order = np.full(count, -1, np.int64)
    order[vertex] = found
    if len(vertex) != fine.size or (order[vertex] != found).any() or len(np.unique(order)) != len(order):
        raise RuntimeError("this version of Blender splits quads in another order")
    return order


def displace(context, mesh, quads):
    """Gives a mesh of level_zero(quads) the levels above it: the highest has the vertices of quads, and others some of these."""
    splits = times(quads)
    order = _order(context, quads.arrays["coarse quads"], quads.quads, splits)
    points = bpy.data.meshes.new(".fine")
    points.vertices.add(len(order))
    points.vertices.foreach_set("co", quads.vertices[order].astype(np.float32).reshape(-1))
    obj, fine = _object(context, ".quads", mesh), _object(context, ".fine", points)
    try:
        obj.modifiers.new(NAME, "MULTIRES")
        with context.temp_override(object=obj, active_object=obj, selected_objects=[obj, fine], selected_editable_objects=[obj, fine]):
            for _ in range(splits):
                bpy.ops.object.multires_subdivide(modifier=NAME, mode="SIMPLE")
            bpy.ops.object.multires_reshape(modifier=NAME)
    finally:
        bpy.data.objects.remove(fine)
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(points)


def remove_modifier(obj, name):
    """While the object still has the mesh of before: Blender takes a mesh's levels with the modifier."""
    if name in obj.modifiers:
        obj.modifiers.remove(obj.modifiers[name])


def add_modifier(obj):
    """A Multiresolution modifier for an object whose mesh has levels, all of them shown: its name."""
    made = obj.modifiers.new(NAME, "MULTIRES")  # Blender takes the levels from the mesh, and puts it before what needs its result
    made.levels = made.sculpt_levels = made.render_levels = made.total_levels
    return made.name


def fingerprint(context, obj):
    """Of the highest level as it is now, whatever level is shown."""
    probe = _object(context, ".levels", obj.data)
    try:
        modifier = probe.modifiers.new(NAME, "MULTIRES")
        modifier.levels = modifier.total_levels
        return _positions(context, probe).tobytes()
    finally:
        bpy.data.objects.remove(probe)
