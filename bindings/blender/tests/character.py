"""A character made here, with all that a character brings along: two UV maps, two materials, colors, weights of ten bones, two shape keys."""
import math

import bmesh
import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

BONES = ["hips", "spine", "head", "arm.L", "hand.L", "arm.R", "hand.R", "leg.L", "leg.R", "tail"]
# Ends of the bones, and the radius of the skin around them.
ENDS = {
    "hips": ((0, 0, 0.9), (0, 0, 1.2), 0.22),
    "spine": ((0, 0, 1.2), (0, 0, 1.6), 0.25),
    "head": ((0, 0, 1.7), (0, 0, 2.05), 0.24),
    "arm.L": ((0.25, 0, 1.5), (0.75, 0, 1.35), 0.1),
    "hand.L": ((0.75, 0, 1.35), (1.1, 0, 1.2), 0.09),
    "arm.R": ((-0.25, 0, 1.5), (-0.75, 0, 1.35), 0.1),
    "hand.R": ((-0.75, 0, 1.35), (-1.1, 0, 1.2), 0.09),
    "leg.L": ((0.14, 0, 0.9), (0.2, 0, 0.05), 0.13),
    "leg.R": ((-0.14, 0, 0.9), (-0.2, 0, 0.05), 0.13),
    "tail": ((0, 0.2, 0.95), (0, 0.9, 0.7), 0.07),
}


def skin(voxel=0.035):
    """(vertices float64 (n, 3), faces): the union of capsules, remeshed by voxels and smoothed."""
    meshes = []
    for start, end, radius in ENDS.values():
        start, end = np.array(start, float), np.array(end, float)
        for t in np.linspace(0, 1, 12):
            mesh = bpy.data.meshes.new("part")
            bm = bmesh.new()
            bmesh.ops.create_uvsphere(bm, u_segments=24, v_segments=16, radius=radius)
            bmesh.ops.translate(bm, vec=tuple(start + t * (end - start)), verts=bm.verts)
            bm.to_mesh(mesh)
            bm.free()
            meshes.append(mesh)
    whole = bmesh.new()
    for mesh in meshes:
        whole.from_mesh(mesh)
        bpy.data.meshes.remove(mesh)
    mesh = bpy.data.meshes.new("character")
    whole.to_mesh(mesh)
    whole.free()
    obj = bpy.data.objects.new("Character", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    remesh = obj.modifiers.new("voxels", "REMESH")
    remesh.mode, remesh.voxel_size = "VOXEL", voxel
    smooth = obj.modifiers.new("smooth", "SMOOTH")
    smooth.iterations, smooth.factor = 8, 0.5
    made = bpy.data.meshes.new_from_object(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    obj.modifiers.clear()
    obj.data = made
    bpy.data.meshes.remove(mesh)
    made.name = "character"
    bm = bmesh.new()
    bm.from_mesh(made)
    bmesh.ops.triangulate(bm, faces=bm.faces)
    bm.to_mesh(made)
    bm.free()
    return obj


def positions(mesh):
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    return places.reshape(-1, 3).astype(float)


def corner_vertices(mesh):
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    return corners


def exact_weights(places):
    """float (n, bones): by the distances to the bones, the four nearest, 1 together."""
    table = np.empty((len(places), len(BONES)))
    for i, name in enumerate(BONES):
        start, end, radius = (np.array(x, float) for x in ENDS[name])
        along = np.clip((places - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
        table[:, i] = np.exp(-((np.linalg.norm(places - start - along[:, None] * (end - start), axis=1) / 0.12) ** 2)) + 1e-9
    np.put_along_axis(table, np.argsort(table, 1, kind="stable")[:, :-4], 0, 1)
    return table / table.sum(1, keepdims=True)


def exact_color(places):
    """float (n, 4)."""
    return np.stack(
        [0.5 + 0.5 * np.sin(4 * places[:, 0]), 0.5 + 0.5 * np.sin(3 * places[:, 1] + 1), 0.5 + 0.5 * np.cos(5 * places[:, 2]), np.ones(len(places))], 1
    )


def exact_uv(places, scale):
    """Of the half that a face belongs to, planar: the front (y < 0) and the back are two charts."""
    return np.stack([places[:, 0], places[:, 2]], 1) * scale


def exact_shapes(places):
    """{name: offsets}."""
    smile = np.zeros_like(places)
    smile[:, 1] = -0.1 * np.exp(-np.sum((places - (0, -0.2, 1.85)) ** 2, 1) / 0.05)
    big = places * 0
    big[:, 0] = 0.15 * np.sin(2 * places[:, 2]) * places[:, 0]
    return {"Smile": smile, "Big": big}


def make(voxel=0.035):
    """The character and its armature."""
    global surface
    obj = skin(voxel)
    mesh = obj.data
    places = positions(mesh)
    surface = BVHTree.FromPolygons(places.tolist(), [list(polygon.vertices) for polygon in mesh.polygons])
    corners = corner_vertices(mesh)
    centers = places[corners].reshape(-1, 3, 3).mean(1)
    back = np.repeat(centers[:, 1] >= 0, 3)
    for name, scale in (("UVMap", 0.3), ("Detail", 1.0)):
        layer = mesh.uv_layers.new(name=name)
        uv = exact_uv(places[corners], scale)
        uv[back, 0] = uv[back, 0] + 10
        layer.data.foreach_set("uv", uv.astype(np.float32).reshape(-1))
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    for name in ("Skin", "Trousers"):
        material = bpy.data.materials.new(name)
        material.diffuse_color = (0.8, 0.55, 0.4, 1) if name == "Skin" else (0.15, 0.25, 0.6, 1)
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", (centers[:, 2] < 1.05).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    color = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", exact_color(places).astype(np.float32).reshape(-1))
    per_corner = mesh.color_attributes.new("Corners", "BYTE_COLOR", "CORNER")
    per_corner.data.foreach_set("color", exact_color(places)[corners].astype(np.float32).reshape(-1))
    weights = exact_weights(places)
    for i, name in enumerate(BONES):
        group = obj.vertex_groups.new(name=name)
        for vertex in np.flatnonzero(weights[:, i] > 0).tolist():
            group.add([vertex], float(weights[vertex, i]), "REPLACE")
    mask = obj.vertex_groups.new(name="Mask")
    mask.add(np.flatnonzero(places[:, 2] > 1.7).tolist(), 0.75, "REPLACE")
    obj.shape_key_add(name="Basis", from_mix=False)
    for name, offsets in exact_shapes(places).items():
        block = obj.shape_key_add(name=name, from_mix=False)
        block.data.foreach_set("co", (places + offsets).astype(np.float32).reshape(-1))
    mesh.shape_keys.key_blocks["Smile"].value = 0.25
    obj.active_shape_key_index = 0
    armature = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", armature)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name in BONES:
        bone = armature.edit_bones.new(name)
        bone.head, bone.tail = ENDS[name][0], ENDS[name][1]
    bpy.ops.object.mode_set(mode="OBJECT")
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    modifier.object = rig
    driver = mesh.shape_keys.key_blocks["Big"].driver_add("value").driver
    driver.expression = "0.125"
    rig.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj, rig


def kept(obj):
    """What an object still has of the character: {what: (is it there, largest error, mean error)}, errors against the exact functions where they
    were meant: at the points of the character's surface next to the quads' vertices, which may lie off it by a tenth of an edge."""
    mesh, told = obj.data, {}
    vertices, corners = positions(mesh), corner_vertices(mesh)
    places = np.array([surface.find_nearest(place)[0] for place in vertices])

    def note(what, difference):
        told[what] = (True, float(np.abs(difference).max()), float(np.abs(difference).mean()))

    for name, scale in (("UVMap", 0.3), ("Detail", 1.0)):
        layer = mesh.uv_layers.get(name)
        told[f"UV map {name}"] = (False, None, None)
        if layer is not None:
            uv = np.empty(2 * len(mesh.loops), np.float32)
            layer.data.foreach_get("uv", uv)
            uv = uv.reshape(-1, 2).astype(float)
            back = uv[:, 0] > 5
            uv[back, 0] -= 10
            note(f"UV map {name}", uv - exact_uv(places[corners], scale))
    for name, at in (("Paint", slice(None)), ("Corners", corners)):
        layer = mesh.color_attributes.get(name)
        told[f"color {name}"] = (False, None, None)
        if layer is not None:
            values = np.empty(4 * len(layer.data), np.float32)
            layer.data.foreach_get("color", values)
            note(f"color {name}", values.reshape(-1, 4) - exact_color(places)[at])
    told["weights of ten bones"] = (False, None, None)
    if len(obj.vertex_groups) >= len(BONES) and any(len(v.groups) for v in mesh.vertices):
        table = np.zeros((len(places), len(obj.vertex_groups)))
        for i, vertex in enumerate(mesh.vertices):
            for element in vertex.groups:
                table[i, element.group] = element.weight
        note("weights of ten bones", table[:, : len(BONES)] - exact_weights(places))
        told["weights sum to 1"] = (
            bool(np.abs(table[:, : len(BONES)].sum(1) - 1).max() < 1e-4),
            float(np.abs(table[:, : len(BONES)].sum(1) - 1).max()),
            None,
        )
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys else {}
    for name, offsets in exact_shapes(places).items():
        told[f"shape key {name}"] = (False, None, None)
        if name in keys:
            moved = np.empty(3 * len(places), np.float32)
            keys[name].data.foreach_get("co", moved)
            note(f"shape key {name}", moved.reshape(-1, 3) - vertices - offsets)
    told["materials"] = (False, None, None)
    index = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    if len(mesh.materials) == 2 and len(np.unique(index)) == 2:
        heights = np.array([places[list(p.vertices)].mean(0)[2] for p in mesh.polygons])
        wrong = (heights < 1.05) != (index == 1)
        told["materials"] = (True, float(np.abs(heights[wrong] - 1.05).max()) if wrong.any() else 0.0, float(wrong.mean()))
    told["smooth shading"] = (all(p.use_smooth for p in mesh.polygons), None, None)
    told["armature modifier"] = ("Armature" in obj.modifiers, None, None)
    told["driver of a shape key"] = (bool(mesh.shape_keys and mesh.shape_keys.animation_data and len(mesh.shape_keys.animation_data.drivers)), None, None)
    return told
