# SPDX-License-Identifier: GPL-3.0-or-later
"""An object's surface as arrays: read once, before a run, and never from Blender again, so that the object may change or be gone meanwhile and
a second run needs no look at it.

Surface coordinates are the object's own, stretched by the symmetric factor of its world matrix where that is uneven, so that quads are
square as they are seen. Rotations and mirrorings (negative scale) change no length and are left out.
"""
import hashlib

import bpy
import numpy as np

from . import bake

# Modifiers that move the finished mesh, frame by frame: they stay on the object and are not applied.
STAYING = {"ARMATURE", "CLOTH", "SOFT_BODY", "COLLISION", "SURFACE", "PARTICLE_SYSTEM", "FLUID", "DYNAMIC_PAINT", "MESH_CACHE", "MESH_SEQUENCE_CACHE"}

LEAST_FACES, MOST_FACES = 8, 20000  # of regions, where no number is asked for: the least of the panel's, the most of the library's own


class Refusal(Exception):
    """A sentence: why this object can't be remeshed."""


def _read(collection, name, dtype, width=1):
    array = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


CONVERTIBLE = {"CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD"}


def no_mesh(obj):
    """A sentence about an object that is none, and what would help."""
    kind = obj.type.lower().replace("_", " ")
    if obj.type in CONVERTIBLE:
        return f"{obj.name} is no mesh ({kind}); Object > Convert > Mesh makes one"
    return f"{obj.name} has no faces ({kind}); select a mesh"


def check_editable(obj):
    if obj.type != "MESH":
        raise Refusal(no_mesh(obj))
    for data, what in ((obj, "object"), (obj.data, "mesh")):
        if data.library is not None:
            raise Refusal(f"the {what} {data.name} is linked from {bpy.path.basename(data.library.filepath)}; Object > Relations > Make Local first")
        if data.override_library is not None:
            raise Refusal(f"the {what} {data.name} is a library override; Object > Relations > Make Local first")
    if obj.mode == "SCULPT" and getattr(obj, "use_dynamic_topology_sculpting", False):
        raise Refusal(f"{obj.name} is being sculpted with dynamic topology; turn that off first")


def stretch_of(obj):
    """(scale, stretch): the surface in the scene is scale times the surface in surface coordinates, which are the object's own (stretch None), or those
    times stretch, float64 (3, 3), symmetric, positive, with scale 1."""
    matrix = np.array(obj.matrix_world.to_3x3(), np.float64)
    if not np.isfinite(matrix).all():
        raise Refusal(f"{obj.name} has a transform that is not finite")
    _, sizes, axes = np.linalg.svd(matrix)
    if sizes[2] <= 1e-7 * sizes[0] or sizes[0] == 0:
        raise Refusal(f"{obj.name} is scaled to nothing along an axis; give it a scale other than 0")
    if sizes[0] <= sizes[2] * (1 + 1e-5):
        return float(sizes.mean()), None
    return 1.0, axes.T @ np.diag(sizes) @ axes


def applied_modifiers(obj, settings):
    """Modifiers that are applied on a copy: those that show in the viewport, except the staying ones."""
    if not settings.apply_modifiers:
        return []
    return [m for m in obj.modifiers if m.show_viewport and m.type not in STAYING]


def selected_faces(obj):
    """bool (faces,): those that are selected in edit mode; of other modes none."""
    if obj.type != "MESH" or obj.mode != "EDIT":
        return np.zeros(0, bool)
    obj.update_from_editmode()
    return _read(obj.data.polygons, "select", bool)


def region_of(obj, settings):
    """bool (faces,): those that alone are remeshed, or None: all of them."""
    if not settings.selected_only or settings.guides == "EDGES":
        return None
    selected = selected_faces(obj)
    return selected if selected.any() and not selected.all() else None


class _Evaluated:
    """A copy of the object with the modifiers that are to be applied, and nothing else; gone afterwards."""

    def __init__(self, context, obj, names):
        self.context, self.evaluated = context, None
        self.object = obj.copy()
        self.object.data = obj.data.copy()
        self.object.animation_data_clear()
        for modifier in self.object.modifiers:
            modifier.show_viewport = modifier.name in names
        context.scene.collection.objects.link(self.object)
        self.object.hide_viewport = False
        if self.object.data.shape_keys:
            self.object.show_only_shape_key = True

    def mesh(self, key):
        if self.object.data.shape_keys:
            self.object.active_shape_key_index = key
        self._clear()
        graph = self.context.evaluated_depsgraph_get()
        graph.update()
        evaluated = self.object.evaluated_get(graph)
        mesh, base = evaluated.data, self.object.data
        if len(mesh.uv_layers) >= len(base.uv_layers) and len(mesh.attributes) >= len(base.attributes) and self._has_weights(mesh):
            return mesh
        self.evaluated = evaluated  # to_mesh(preserve_all_data_layers=True) leaks a mesh in Blender 3.4: only where it must be
        return evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=graph)

    def _has_weights(self, mesh):
        return not any(len(v.groups) for v in self.object.data.vertices) or any(len(v.groups) for v in mesh.vertices)

    def _clear(self):
        if self.evaluated is not None:
            self.evaluated.to_mesh_clear()
            self.evaluated = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._clear()
        data = self.object.data
        self.context.scene.collection.objects.unlink(self.object)
        self.context.view_layer.update()  # the dependency graph lets go of its copies before what they are of is gone
        bpy.data.objects.remove(self.object)
        bpy.data.meshes.remove(data)


class Snapshot:
    """vertices: float64 (n, 3), surface coordinates. corners: int32 (c,), sizes: int32 (m,). notes: sentences for the report.
    region: bool (m,), the faces that are remeshed, or None; without modifiers then. picked: what is selected of the result, as bytes."""

    def __init__(self, context, obj, settings):
        check_editable(obj)
        self.object_name = obj.name
        self.mesh_name = obj.data.name
        self.notes = []
        self.levels = None  # of its quads: the name of their Multiresolution modifier, and what the highest level was
        self.scale, self.stretch = stretch_of(obj)
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        self.region, self.picked = region_of(obj, settings), None
        self.bakes, self.look, self.corner_normals = settings.bake, None, None
        if (settings.bake or settings.unwrap) and self.region is not None:
            raise Refusal(f"{obj.name} has some faces selected, and whole meshes alone are unwrapped; select none or all")
        wraps_points = settings.option_wrap and len(obj.data.vertices) > 2
        if not obj.data.polygons and not applied_modifiers(obj, settings) and not wraps_points:
            raise Refusal(f"{obj.name} has no faces" + ("; with Wrap its points become a surface" if len(obj.data.vertices) > 2 else ""))
        self.before = fingerprint(obj.data)
        applied = applied_modifiers(obj, settings) if self.region is None else []
        self.applied = [m.name for m in applied]
        self.mirrors = [self._mirror(obj, m) for m in applied if m.type == "MIRROR" and any(m.use_axis)]
        self.has_armature = any(m.type == "ARMATURE" for m in obj.modifiers)
        self.group_names = [g.name for g in obj.vertex_groups]
        self.bones = {
            bone.name
            for m in obj.modifiers
            if m.type == "ARMATURE" and m.object and m.object.type == "ARMATURE"
            for bone in m.object.data.bones
            if bone.use_deform
        }
        self.to_surface = np.array(obj.matrix_world.inverted(), np.float64)
        self.local_vertices = None
        if applied:
            with _Evaluated(context, obj, self.applied) as copy:
                self._take(obj, copy.mesh(0))
                self._take_shapes(obj, lambda index: _read(copy.mesh(index).vertices, "co", np.float32, 3))
        elif obj.mode == "EDIT":
            copy = obj.data.copy()  # the mesh itself has no layers while it is edited
            try:
                self._take_base(obj, copy)
            finally:
                bpy.data.meshes.remove(copy)
        else:
            self._take_base(obj, obj.data)
        if not len(self.sizes) and not (wraps_points and not applied):
            raise Refusal(f"{obj.name} has no faces" + (" after its modifiers" if applied else ""))
        self.slots = [m.name if m else None for m in obj.data.materials]
        if self.bakes and len(self.sizes):
            self.take_look(obj)

    def take_look(self, obj):
        """What its materials look like, to be baked."""
        self.look = bake.Look(obj, self.uvs)
        self.notes += self.look.notes

    def _take_base(self, obj, mesh):
        self._take(obj, mesh)
        keys = mesh.shape_keys
        if keys:
            self._place(_read(keys.reference_key.data, "co", np.float32, 3))
        self._take_shapes(obj, lambda index: _read(keys.key_blocks[index].data, "co", np.float32, 3))

    def _mirror(self, obj, modifier):
        """(modifier's name, axis or -1 where there are several, plane normal and offset in the object's own coordinates, has another object)."""
        axes = [i for i in range(3) if modifier.use_axis[i]]
        normal, offset = np.eye(3)[axes[0]], 0.0
        if modifier.mirror_object:
            frame = np.array(obj.matrix_world.inverted() @ modifier.mirror_object.matrix_world, np.float64)
            normal = np.linalg.inv(frame[:3, :3]).T @ normal
            normal /= np.linalg.norm(normal)
            offset = float(normal @ frame[:3, 3])
        return modifier.name, axes[0] if len(axes) == 1 else -1, normal, offset, modifier.mirror_object is not None

    def _place(self, local):
        wrong = np.flatnonzero(~np.isfinite(local).all(1))
        if len(wrong):
            many = "1 vertex that is" if len(wrong) == 1 else f"{len(wrong):,} vertices that are"
            raise Refusal(f"{self.object_name} has {many} nowhere (NaN or infinite coordinates), such as vertex {wrong[0]}; delete or move what is there first")
        self.local_vertices = local
        self.vertices = local.astype(np.float64)
        if self.stretch is not None:
            self.vertices = self.vertices @ self.stretch

    def _take(self, obj, mesh):
        self._place(_read(mesh.vertices, "co", np.float32, 3))
        self.corners = _read(mesh.loops, "vertex_index", np.int32)
        self.sizes = _read(mesh.polygons, "loop_total", np.int32)
        self.edges = _read(mesh.edges, "vertices", np.int32, 2)
        self.edge_marks = self._marks(mesh)
        selected = _read(mesh.edges, "select", bool)
        self.selected_edges = self.edges[selected]
        self.materials = _read(mesh.polygons, "material_index", np.int32)
        self.smooth = _read(mesh.polygons, "use_smooth", bool)
        self.hidden = _read(mesh.polygons, "hide", bool)
        self.uvs = [(layer.name, layer.active, layer.active_render, _read(layer.data, "uv", np.float32, 2)) for layer in mesh.uv_layers]
        self.colors = [self._color(layer) for layer in getattr(mesh, "color_attributes", ()) if layer.domain in ("POINT", "CORNER")]
        self.active_color = getattr(getattr(mesh, "color_attributes", None), "active_color_index", -1)
        self.render_color = getattr(getattr(mesh, "color_attributes", None), "render_color_index", -1)
        if self.bakes:
            self.corner_normals = self._normals(mesh)
        self.weights = self._weights(mesh)
        others = self._others(mesh)
        if others:
            self.notes.append(f"attributes that are neither UVs nor colors were lost: {', '.join(others)}")
        if mesh.has_custom_normals:
            self.notes.append("custom normals were lost")
        self.base_center = _read(obj.data.vertices, "co", np.float32, 3).mean(0) if len(obj.data.vertices) else np.zeros(3)

    def _normals(self, mesh):
        """float32 (corners, 3), in surface coordinates: those that Blender shows."""
        if hasattr(mesh, "calc_normals_split"):  # before Blender 4.1
            mesh.calc_normals_split()
            normals = _read(mesh.loops, "normal", np.float32, 3)
        else:
            normals = _read(mesh.corner_normals, "vector", np.float32, 3)
        return normals if self.stretch is None else (normals @ np.linalg.inv(self.stretch)).astype(np.float32)

    @staticmethod
    def _others(mesh):
        """Names of attributes that are not carried over: what is no layer that is read here, and no part of every mesh."""
        read = (
            {layer.name for layer in mesh.uv_layers}
            | {layer.name for layer in getattr(mesh, "color_attributes", ())}
            | {group.name for group in getattr(mesh, "vertex_groups", ())}
        )
        usual = {"position", "material_index", "sharp_edge", "sharp_face", "crease_edge", "uv_seam", "custom_normal", "id"}
        return [
            a.name
            for a in mesh.attributes
            if a.name not in read | usual and not a.name.startswith(".") and a.domain in ("POINT", "EDGE", "FACE", "CORNER")
        ]

    @staticmethod
    def _color(layer):
        return {"name": layer.name, "domain": layer.domain, "type": layer.data_type, "values": _read(layer.data, "color", np.float32, 4)}

    def _marks(self, mesh):
        """{kind: bool (edges,)}, of the panel's MARKS."""
        marks = {"SHARP": _read(mesh.edges, "use_edge_sharp", bool), "SEAM": _read(mesh.edges, "use_seam", bool)}
        crease = mesh.attributes.get("crease_edge")
        if crease is not None and crease.domain == "EDGE":
            self.creases = _read(crease.data, "value", np.float32)
        elif hasattr(bpy.types.MeshEdge, "crease") or (len(mesh.edges) and hasattr(mesh.edges[0], "crease")):
            self.creases = _read(mesh.edges, "crease", np.float32)
        else:
            self.creases = np.zeros(len(mesh.edges), np.float32)
        marks["CREASE"] = self.creases >= 0.5
        face_of_corner = np.repeat(np.arange(len(self.sizes)), self.sizes)
        edge_of_corner = _read(mesh.loops, "edge_index", np.int32)
        self.edge_of_corner = edge_of_corner
        marks["MATERIAL"] = self._borders(len(mesh.edges), edge_of_corner, _read(mesh.polygons, "material_index", np.int32)[face_of_corner])
        sets = mesh.attributes.get(".sculpt_face_set")
        self.has_face_sets = sets is not None
        if sets is not None and sets.domain == "FACE":
            marks["FACE_SET"] = self._borders(len(mesh.edges), edge_of_corner, _read(sets.data, "value", np.int32)[face_of_corner])
        else:
            marks["FACE_SET"] = np.zeros(len(mesh.edges), bool)
        return marks

    @staticmethod
    def _borders(count, edge_of_corner, label):
        """bool (count,): edges whose faces have more than one label."""
        least, most = np.full(count, np.iinfo(np.int32).max), np.full(count, np.iinfo(np.int32).min)
        np.minimum.at(least, edge_of_corner, label)
        np.maximum.at(most, edge_of_corner, label)
        return (least < most) & (most > np.iinfo(np.int32).min)

    def _weights(self, mesh):
        """float32 (groups, n), or None."""
        if not self.group_names:
            return None
        weights = np.zeros((len(self.group_names), len(mesh.vertices)), np.float32)
        self.most_influences = 0
        for index, vertex in enumerate(mesh.vertices):
            for element in vertex.groups:
                if element.group < len(weights):
                    weights[element.group, index] = element.weight
        return weights

    def _take_shapes(self, obj, read):
        """shapes: [(settings, offsets float32 (n, 3), in the object's own coordinates)] without the reference."""
        self.shapes, self.reference_name = [], None
        keys = obj.data.shape_keys
        if not keys:
            return
        self.reference_name = keys.reference_key.name
        lost = []
        for index, block in enumerate(keys.key_blocks):
            if block == keys.reference_key:
                continue
            placed = read(index)
            if placed.shape != self.local_vertices.shape:
                lost.append(block.name)
                continue
            about = {
                "name": block.name,
                "placed": placed,
                "value": block.value,
                "min": block.slider_min,
                "max": block.slider_max,
                "mute": block.mute,
                "group": block.vertex_group,
                "interpolation": block.interpolation,
                "relative": block.relative_key.name if block.relative_key else self.reference_name,
            }
            self.shapes.append((about, placed - self.local_vertices))
        if lost:
            self.notes.append(f"shape keys for which the modifiers give another mesh were lost: {', '.join(lost)}")

    # ---- what the settings make of it

    def marks(self, settings):
        """int32 (k, 2): edges that are marked, of the chosen kinds."""
        chosen = np.zeros(len(self.edges), bool)
        for kind in settings.marks:
            chosen |= self.edge_marks[kind]
        return self.edges[chosen]

    def density(self, settings):
        """float32 (n,), or None: how many times shorter edges are to be."""
        if settings.density == "GROUP":
            if settings.density_group not in self.group_names:
                raise Refusal(f"{self.object_name} has no vertex group named {settings.density_group!r}; choose the density's group")
            amount = self.weights[self.group_names.index(settings.density_group)]
        elif settings.density == "COLOR":
            layer = next((c for c in self.colors if c["name"] == settings.density_color), None)
            if layer is None:
                raise Refusal(f"{self.object_name} has no color attribute named {settings.density_color!r}; choose the density's color")
            amount = layer["values"][:, :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
            if layer["domain"] == "CORNER":
                count = np.bincount(self.corners, minlength=len(self.vertices))
                amount = np.bincount(self.corners, amount, len(self.vertices)) / np.maximum(count, 1)
        else:
            return None
        return (float(f"{settings.contrast:.7g}") ** np.clip(amount, 0, 1)).astype(np.float32)

    def faces_of_region(self):
        """Quads for a quarter of the region's triangles, as is automatic for whole surfaces, but without the 100 that those have at the least."""
        return int(np.clip((self.sizes[self.region] - 2).sum() // 4, LEAST_FACES, MOST_FACES))

    def from_world(self, points):
        """Surface coordinates of points of the scene, float64 (n, 3)."""
        local = points @ self.to_surface[:3, :3].T + self.to_surface[:3, 3]
        return local if self.stretch is None else local @ self.stretch

    def to_local(self, points):
        """The object's own coordinates of surface coordinates."""
        return points if self.stretch is None else points @ np.linalg.inv(self.stretch)

    def plane(self, settings):
        """Options of symmetry."""
        if settings.symmetry in ("AUTO", "ANY") and not self.mirrors:
            return {"symmetry": settings.symmetry.lower()}
        axis = "XYZ".find(settings.symmetry)
        if axis >= 0 and self.stretch is None:
            return {"symmetry": "xyz"[axis]}
        if axis >= 0:
            normal, offset = np.eye(3)[axis], 0.0
        elif self.mirrors:
            _, _, normal, offset, _ = self.mirrors[0]
        else:
            return {"symmetry": "none"}
        if self.stretch is not None:
            normal = np.linalg.inv(self.stretch) @ normal
        return {
            "symmetry": "plane",
            "symmetry_x": float(normal[0]),
            "symmetry_y": float(normal[1]),
            "symmetry_z": float(normal[2]),
            "symmetry_offset": float(offset),
        }

    @property
    def halving(self):
        """(modifier's name, axis, side 1 or -1) of the one Mirror modifier that can stay, with half of the quads under it; None without."""
        if len(self.mirrors) != 1 or self.mirrors[0][1] < 0 or self.mirrors[0][4]:
            return None
        name, axis = self.mirrors[0][:2]
        return name, axis, 1 if self.base_center[axis] >= 0 else -1


def fingerprint(mesh):
    """Of the positions and corners: whether a mesh is still the one that was read."""
    digest = hashlib.sha256()
    digest.update(_read(mesh.vertices, "co", np.float32).tobytes() if not len(mesh.vertices) else _read(mesh.vertices, "co", np.float32, 3).tobytes())
    digest.update(_read(mesh.loops, "vertex_index", np.int32).tobytes())
    digest.update(_read(mesh.polygons, "loop_total", np.int32).tobytes())
    return digest.hexdigest()


# ---- guides

PENCILS = {"GPENCIL", "GREASEPENCIL"}  # before Blender 4.3, and since
POINTS_ACROSS, ENDS_MEET = 90, 0.1  # points of a stroke along the surface's diagonal; share of its length


def chains(edges):
    """Paths of edges, int32 (k, 2), cut where other than two meet: [(vertices, closed)]."""
    at = {}
    for index, (a, b) in enumerate(edges.tolist()):
        at.setdefault(a, []).append((b, index))
        at.setdefault(b, []).append((a, index))
    used, made = set(), []

    def walk(start, step):
        path, here = [start], step
        while True:
            other, index = here
            used.add(index)
            path.append(other)
            following = [n for n in at[other] if n[1] not in used]
            if len(at[other]) != 2 or not following:
                return path
            here = following[0]

    for vertex in at:
        if len(at[vertex]) != 2:
            for step in at[vertex]:
                if step[1] not in used:
                    made.append((walk(vertex, step), False))
    for vertex in at:
        for step in at[vertex]:
            if step[1] not in used:
                path = walk(vertex, step)
                made.append((path[:-1], True) if path[0] == path[-1] else (path, False))
    return made


def curve_guides(context, curve):
    """Polylines of a curve object, in the scene: [(points float64 (n, 3), closed)]."""
    copy = curve.copy()
    copy.data = curve.data.copy()
    evaluated = None
    try:
        copy.animation_data_clear()
        copy.data.bevel_depth, copy.data.extrude, copy.data.bevel_object, copy.data.taper_object = 0, 0, None, None
        copy.data.dimensions = "3D"
        context.scene.collection.objects.link(copy)
        graph = context.evaluated_depsgraph_get()
        graph.update()
        evaluated = copy.evaluated_get(graph)
        mesh = evaluated.to_mesh()
        if not len(mesh.edges):
            raise Refusal(f"the curve {curve.name} has no splines of two points")
        points = _read(mesh.vertices, "co", np.float32, 3).astype(np.float64)
        matrix = np.array(curve.matrix_world, np.float64)
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
        return [(points[path], closed) for path, closed in chains(_read(mesh.edges, "vertices", np.int32, 2))]
    finally:
        if evaluated is not None:
            evaluated.to_mesh_clear()
        data = copy.data
        bpy.data.objects.remove(copy)
        bpy.data.curves.remove(data)


def pencil_guides(pencil, snapshot):
    """Polylines of the visible strokes of a grease pencil, in surface coordinates: [(points float64 (n, 3), closed)]. A stroke whose ends nearly meet
    is closed; points next to the one before are left out, as a hand is not steady."""
    matrix, spacing, found = np.array(pencil.matrix_world, np.float64), np.linalg.norm(np.ptp(snapshot.vertices, axis=0)) / POINTS_ACROSS, []
    for layer in pencil.data.layers:
        frame = layer.current_frame() if hasattr(layer, "current_frame") else layer.active_frame  # Blender 4.3 and later; before
        if layer.hide or frame is None:
            continue
        for stroke in getattr(frame, "drawing", frame).strokes:
            drawn = np.array([getattr(p, "position", None) or p.co for p in stroke.points], np.float64).reshape(-1, 3)
            drawn = snapshot.from_world(drawn @ matrix[:3, :3].T + matrix[:3, 3])
            steps = np.linalg.norm(np.diff(drawn, axis=0), axis=1)
            closed = getattr(stroke, "cyclic", False) or getattr(stroke, "use_cyclic", False)
            closed = closed or (len(drawn) > 3 and np.linalg.norm(drawn[-1] - drawn[0]) < ENDS_MEET * steps.sum())
            kept = []
            for point in drawn:
                if not kept or np.linalg.norm(point - kept[-1]) >= spacing:
                    kept.append(point)
            if closed and len(kept) > 3 and np.linalg.norm(kept[-1] - kept[0]) < spacing:
                kept.pop()
            found.append((np.array(kept).reshape(-1, 3), closed))
    if not found:
        raise Refusal(f"the grease pencil {pencil.name} has no strokes")
    return found


def guides_of(context, snapshot, settings):
    """[(kind, closed, points float64 (n, 3) in surface coordinates)]."""
    if settings.guides == "CURVE":
        if settings.guide_curve is None:
            raise Refusal("guides are to come from a curve, but none is chosen")
        if settings.guide_curve.type in PENCILS:
            found = pencil_guides(settings.guide_curve, snapshot)
        else:
            found = [(snapshot.from_world(points), closed) for points, closed in curve_guides(context, settings.guide_curve)]
    elif settings.guides == "EDGES":
        if not len(snapshot.selected_edges):
            raise Refusal(f"guides are to come from selected edges, but {snapshot.object_name} has none selected")
        found = [(snapshot.vertices[path], closed) for path, closed in chains(snapshot.selected_edges)]
    else:
        return []
    kind = settings.guide_kind.lower()
    return [(kind, closed and len(points) >= 3, points) for points, closed in found if len(points) >= 2]
