# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads into Blender: a new mesh with all that was carried over, made whole beside the old one, which it then replaces."""
import bpy
import numpy as np

from .snapshot import Refusal


def attributes_of(snapshot, keep):
    """(header of the attributes, arrays): what the library is to carry over of a Snapshot."""
    about, arrays = {}, {}

    def add(name, values, per, kind, groups=None):
        about[name] = {"array": "a:" + name, "per": per, "kind": kind}
        arrays["a:" + name] = values
        if groups is not None:
            about[name]["groups"] = "g:" + name
            arrays["g:" + name] = groups

    if "MATERIALS" in keep:
        add("material", snapshot.materials, "face", "labels")
        add("smooth", snapshot.smooth.astype(np.int32), "face", "labels")
    if "UVS" in keep:
        for i, (_, _, _, values) in enumerate(snapshot.uvs):
            add(f"uv {i}", values, "corner", "uvs")
    if "COLORS" in keep:
        for i, layer in enumerate(snapshot.colors):
            add(f"color {i}", layer["values"], "vertex" if layer["domain"] == "POINT" else "corner", "values")
    if "WEIGHTS" in keep and snapshot.weights is not None:
        bones, others = split_groups(snapshot)
        if len(bones):
            groups, weights = influences(snapshot.weights, bones)
            add("weights", weights, "vertex", "weights", groups)
        for i in range(0, len(others), 16):
            add(f"groups {i // 16}", np.ascontiguousarray(snapshot.weights[others[i : i + 16]].T), "vertex", "values")
    if "SHAPES" in keep:
        for i, (_, offsets) in enumerate(snapshot.shapes):
            add(f"target:{i}", offsets.astype(np.float32), "vertex", "values")
    return about, arrays


def split_groups(snapshot):
    """(vertex groups whose weights are those of bones and sum to 1 everywhere, the others), indices. The first are limited to as many a vertex
    as came in; the others are interpolated as they are."""
    bones = np.array([i for i, name in enumerate(snapshot.group_names) if name in snapshot.bones], np.int64)
    if len(bones):
        sums = snapshot.weights[bones].sum(0)
        if (np.abs(sums - 1) > 1e-3).any() or (snapshot.weights[bones] > 0).sum(0).max() > 16:
            bones = bones[:0]
    return bones, np.setdiff1d(np.arange(len(snapshot.group_names)), bones)


def influences(weights, bones):
    """(groups uint32 (n, k), weights float32 (n, k)): the pairs of every vertex, k as many as any has."""
    table = weights[bones].T
    most = max(1, int((table > 0).sum(1).max()))
    order = np.argsort(-table, axis=1, kind="stable")[:, :most]
    return bones[order].astype(np.uint32), np.ascontiguousarray(np.take_along_axis(table, order, 1))


class Quads:
    """What the worker gave: vertices float64 (n, 3) in the object's own coordinates, quads int32 (m, 4), and what was carried.
    coarse: with levels, float64 (k, 3), the first vertices as they were before the quads were split.
    Behind the quads come the faces of a region's surroundings: kept int32 (k,), vertices at their corners; kept_sizes int32 (faces,);
    kept_from int32 (k,), those corners of the surface. still, still_from: vertices of theirs, and those of the surface that they are.
    loose: int32 (edges, 2), those of no face."""

    has_levels = False  # whether its mesh has those of a Multiresolution modifier

    def __init__(self, snapshot, arrays):
        self.vertices = snapshot.to_local(arrays["vertices"])
        self.coarse = snapshot.to_local(arrays["coarse vertices"]) if "coarse vertices" in arrays else None
        self.quads = arrays["quads"]
        none = np.zeros(0, np.int32)
        self.kept, self.kept_sizes, self.kept_from = (arrays.get(name, none) for name in ("kept", "kept sizes", "kept from"))
        self.arrays = arrays
        self.still = self.still_from = none
        self.loose = np.zeros((0, 2), np.int32)
        if snapshot.region is not None:
            self._let_stay(snapshot)

    def _let_stay(self, snapshot):
        """Around the region all is as it was: vertices that the library joined, as they lie on one another, are several again, and there
        is what belongs to no face."""
        source = snapshot.corners[self.kept_from]
        at_rim = np.isin(self.kept, self.quads)
        stays = ~at_rim | (self.arrays["vertices"][self.kept] == snapshot.vertices[source]).all(1)  # a rim that is cut anew has other vertices, too
        number = np.full(len(snapshot.vertices), -1, np.int64)  # of the surface's vertices: in the result
        inside = np.isin(source, snapshot.corners[np.repeat(snapshot.region, snapshot.sizes)])
        holds, other = stays & at_rim & inside, stays & ~(at_rim & inside)
        for joined in (holds, other):  # of those that were joined the first stays, at the rim one of the region
            vertices, first = np.unique(self.kept[joined], return_index=True)
            free = ~np.isin(vertices, number)
            number[source[joined][first[free]]] = vertices[free]
        number[source[holds]] = self.kept[holds]
        apart = np.union1d(source[stays & (number[source] < 0)], np.setdiff1d(np.arange(len(number)), snapshot.corners)).astype(np.int64)
        number[apart] = len(self.vertices) + np.arange(len(apart))
        self.kept = np.where(other, number[source], self.kept).astype(np.int32)  # joined again, too, where the library had cut
        self.still, self.still_from = np.concatenate([self.kept[stays], number[apart]]), np.concatenate([source[stays], apart])
        self.vertices = np.concatenate([self.vertices, snapshot.local_vertices[apart]])
        self.vertices[self.still] = snapshot.local_vertices[self.still_from]  # not what the way there and back makes of them
        self._append(snapshot, apart)
        loose = number[np.delete(snapshot.edges, snapshot.edge_of_corner, 0)]
        self.loose = loose[(loose >= 0).all(1)].astype(np.int32)

    def _append(self, snapshot, apart):
        """What vertices of the surface, behind all others now, have."""
        about, given = attributes_of(snapshot, {"COLORS", "WEIGHTS", "SHAPES"})
        for name, row in about.items():
            for array in [row["array"]] + ([row["groups"]] if "groups" in row else []):
                if row["per"] == "vertex" and array in self.arrays:
                    made = self.arrays[array]
                    width = made.size // len(made)
                    own = given[array].reshape(len(given[array]), -1)[apart, :width]
                    self.arrays[array] = np.concatenate([made.reshape(-1, width), own])

    @property
    def corners(self):
        """int32: the vertices at all corners."""
        return np.concatenate([self.quads.reshape(-1), self.kept])

    @property
    def sizes(self):
        """int32: corners of all faces."""
        return np.concatenate([np.full(len(self.quads), 4, np.int32), self.kept_sizes])

    @property
    def following(self):
        """int64: for each corner the next one of its face."""
        sizes = self.sizes
        ends = np.cumsum(sizes)
        following = np.arange(1, 1 + int(sizes.sum()))
        following[ends - 1] = ends - sizes
        return following

    def vertex(self, name):
        return self.arrays.get(name)

    def half(self, axis, side):
        """The half on one side of the plane of an axis, or None where a quad crosses it."""
        distance = self.vertices[:, axis] * side
        tolerance = 1e-6 * max(1e-30, float(np.ptp(self.vertices, axis=0).max()))
        on_side = distance > tolerance
        beyond = distance < -tolerance
        touches, crosses = on_side[self.quads].any(1), beyond[self.quads].any(1)
        if (touches & crosses).any() or not touches.any():
            return None
        faces = np.flatnonzero(touches)
        used = np.unique(self.quads[faces])
        number = np.full(len(self.vertices), -1, np.int64)
        number[used] = np.arange(len(used))
        counts = {len(self.vertices): used, len(self.quads): faces, 4 * len(self.quads): (4 * faces[:, None] + np.arange(4)).reshape(-1)}
        made = Quads.__new__(Quads)
        made.vertices = self.vertices[used].copy()
        made.vertices[~on_side[used], axis] = 0
        made.quads = number[self.quads[faces]].astype(np.int32)
        made.kept = made.kept_sizes = made.kept_from = made.still = made.still_from = np.zeros(0, np.int32)
        made.loose = self.loose
        made.arrays = {}
        made.coarse = self.coarse
        if self.coarse is not None and not made._halve_level_zero(self, faces, used[used < len(self.coarse)], number, axis, on_side):
            return None
        vertices, quads, corners = len(self.vertices), len(self.quads), 4 * len(self.quads)
        for name, array in self.arrays.items():
            if name in ("vertices", "quads") or name.startswith("coarse "):
                continue
            if name == "creases":
                both = number[array]
                made.arrays[name] = both[(both >= 0).all(1)]
                continue
            made.arrays[name] = array[self._rows(name, array, counts, (vertices, quads, corners))]
        return made

    def _halve_level_zero(self, whole, faces, used, number, axis, on_side):
        """Level 0 of a half; False where one of its quads crosses the plane."""
        coarse = whole.arrays["coarse quads"]
        block = len(whole.quads) // len(coarse)
        chosen = np.unique(faces // block)
        self.coarse = whole.coarse[used].copy()
        self.coarse[~on_side[used], axis] = 0
        self.arrays["coarse quads"] = number[coarse[chosen]].astype(np.int32)
        return len(faces) == block * len(chosen)

    def _rows(self, name, array, counts, sizes):
        vertices, quads, corners = sizes
        word = name.split(":", 1)[-1].split(" ")[0]
        if word in ("material", "smooth"):
            return counts[quads]
        if word == "uv":
            return counts[corners]
        if word == "color":
            return counts[corners] if len(array) == corners else counts[vertices]
        return counts[vertices]


def _require_apart(name, quads):
    """Blender's coordinates are of single precision: far from the object's origin vertices that are close fall together."""
    exact, single = quads.vertices, quads.vertices.astype(np.float32)
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)):
        a, b = quads.quads[:, a], quads.quads[:, b]
        if ((single[a] == single[b]).all(1) & (exact[a] != exact[b]).any(1)).any():
            raise Refusal(f"{name} lies so far from its origin that vertices of the quads would fall together; Object > Set Origin > Origin to Geometry first")


def build(snapshot, quads, old, keep):
    """A mesh with the quads and what was carried over, without shape keys and vertex groups' weights (those need an object: dress())."""
    _require_apart(snapshot.object_name, quads)
    mesh = old.copy()
    try:
        mesh.clear_geometry()
        count, corners, sizes = len(quads.vertices), quads.corners, quads.sizes
        mesh.vertices.add(count)
        mesh.vertices.foreach_set("co", quads.vertices.astype(np.float32).reshape(-1))
        mesh.edges.add(len(quads.loose))
        mesh.edges.foreach_set("vertices", quads.loose.reshape(-1))
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(sizes))
        mesh.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
        try:
            mesh.polygons.foreach_set("loop_total", sizes)
        except (AttributeError, TypeError, RuntimeError):
            pass  # read only since 4.1: found from the starts
        arrays = quads.arrays
        if "a:material" in arrays and "a:smooth" in arrays:
            mesh.polygons.foreach_set("material_index", np.maximum(arrays["a:material"], 0).astype(np.int32))
            mesh.polygons.foreach_set("use_smooth", arrays["a:smooth"] > 0)
        mesh.update(calc_edges=True)
        if "UVS" in keep:
            _add_uvs(mesh, snapshot, arrays)
        if "COLORS" in keep:
            _add_colors(mesh, snapshot, arrays)
        if "a:filled" in arrays:  # faces in holes that were closed
            if "filled" in mesh.attributes:
                mesh.attributes.remove(mesh.attributes["filled"])
            mesh.attributes.new("filled", "BOOLEAN", "FACE").data.foreach_set("value", arrays["a:filled"] > 0)
        if mesh.validate(verbose=False):
            if len(quads.kept_sizes):
                raise Refusal(f"{snapshot.object_name} has faces outside the selection that are no valid faces; Mesh > Clean Up first")
            raise RuntimeError("the quads are no valid mesh")
    except BaseException:
        bpy.data.meshes.remove(mesh)
        raise
    return mesh


def own_of(snapshot, quads):
    """What the worker gave of texture coordinates, normals and maps of the quads' own; normals as the object has them."""
    given = {name: array for name, array in quads.arrays.items() if name.startswith(("own ", "map "))}
    if snapshot.stretch is not None and "own normal" in given:
        normals = given["own normal"].reshape(-1, 3) @ snapshot.stretch
        given["own normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return given


def _add_uvs(mesh, snapshot, arrays):
    for i, (name, is_active, is_rendered, _) in enumerate(snapshot.uvs):
        layer = mesh.uv_layers.new(name=name, do_init=False)
        if layer is None:
            continue
        layer.data.foreach_set("uv", np.ascontiguousarray(arrays[f"a:uv {i}"], np.float32).reshape(-1))
    for name, is_active, is_rendered, _ in snapshot.uvs:
        layer = mesh.uv_layers.get(name)
        if layer and is_active:
            mesh.uv_layers.active = layer
        if layer and is_rendered:
            layer.active_render = True


def _add_colors(mesh, snapshot, arrays):
    for i, layer in enumerate(snapshot.colors):
        made = mesh.color_attributes.new(layer["name"], layer["type"], layer["domain"])
        made.data.foreach_set("color", np.ascontiguousarray(arrays[f"a:color {i}"], np.float32).reshape(-1))
    if snapshot.colors and 0 <= snapshot.active_color < len(mesh.color_attributes):
        mesh.color_attributes.active_color_index = snapshot.active_color
    if snapshot.colors and 0 <= snapshot.render_color < len(mesh.color_attributes):
        mesh.color_attributes.render_color_index = snapshot.render_color


def _on_lines(snapshot, quads, edges, lines):
    """bool (edges,): edges of the quads, int32 (k, 2), that lie on lines, int32 (l, 2) of the surface's vertices: both ends and the middle within a tenth
    of an edge."""
    from mathutils.kdtree import KDTree

    local = snapshot.local_vertices.astype(np.float64)
    start, end = local[lines[:, 0]], local[lines[:, 1]]
    points = quads.vertices
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    near = 0.1 * float(np.linalg.norm(a - b, axis=1).mean())
    steps = np.maximum(1, np.ceil(np.linalg.norm(end - start, axis=1) / near)).astype(np.int64)
    line = np.repeat(np.arange(len(lines)), steps + 1)
    along = (np.arange(len(line)) - np.repeat(np.cumsum(steps + 1) - steps - 1, steps + 1)) / steps[line]
    samples = start[line] + along[:, None] * (end[line] - start[line])
    tree = KDTree(len(samples))
    for i, sample in enumerate(samples.tolist()):
        tree.insert(sample, i)
    tree.balance()
    is_near = np.array([tree.find(p)[2] < 1.2 * near for p in points.tolist()])
    on = is_near[edges].all(1)
    middle = 0.5 * (a + b)
    on[on] = [tree.find(p)[2] < 1.2 * near for p in middle[on].tolist()]
    return on


def _uv_borders(mesh, quads, edges, uv):
    """bool (edges,): edges at which texture coordinates of corners, float32 (corners, 2), of their two faces differ by more than a fifth of an edge; corners that
    meet within a chart may differ a little, as each is looked up in its own quad."""
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", corners)
    starts = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", starts)
    following = uv[quads.following]
    is_first = starts == edges[corners, 0]
    low, high = np.where(is_first[:, None], uv, following), np.where(is_first[:, None], following, uv)
    both = np.concatenate([low, high], 1)
    least, most = np.full((len(edges), 4), np.inf), np.full((len(edges), 4), -np.inf)
    np.minimum.at(least, corners, both)
    np.maximum.at(most, corners, both)
    return (most - least > 0.2 * np.median(np.abs(following - uv).sum(1))).any(1)


def mark_edges(mesh, snapshot, quads, followed):
    """Marks of edges on the quads: those of kinds that the quads follow, and seams where the first UV map has them. Edges of faces that
    stayed have the marks that they had. Names of those that are lost."""
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    edges, lost = edges.reshape(-1, 2), []
    origin = _kept_edges(mesh, snapshot, quads)
    is_new, gone = origin < 0, np.ones(len(snapshot.edges), bool)
    gone[origin[~is_new]] = False
    for kind, name in (("SHARP", "sharp edges"), ("SEAM", "seams"), ("CREASE", "creases")):
        lines = snapshot.edges[snapshot.edge_marks[kind]]
        is_own = kind == "SEAM" and "own uv" in quads.arrays
        is_cage = kind == "CREASE" and "creases" in quads.arrays
        if not len(lines) and not is_own and not is_cage and not (kind == "CREASE" and snapshot.creases[~gone].any()):
            continue
        if is_own:
            on = _uv_borders(mesh, quads, edges, quads.arrays["own uv"].reshape(-1, 2))
        elif kind == "SEAM" and "a:uv 0" in quads.arrays:
            on = _uv_borders(mesh, quads, edges, quads.arrays["a:uv 0"].reshape(-1, 2))
        else:
            on = np.zeros(len(edges), bool)
            if kind not in followed:
                lost += [name] if snapshot.edge_marks[kind][gone].any() else []
            elif len(lines) and is_new.any():
                on[is_new] = _on_lines(snapshot, quads, edges[is_new], lines)
        on[~is_new] = snapshot.edge_marks[kind][origin[~is_new]]
        if is_cage:
            on |= _among(edges, quads.arrays["creases"], len(quads.vertices))
            _set_corners(mesh, quads.arrays["creases"])
        if kind == "CREASE":
            creases = on.astype(np.float32)
            creases[~is_new] = snapshot.creases[origin[~is_new]]
            _set_creases(mesh, creases)
        else:
            mesh.edges.foreach_set("use_edge_sharp" if kind == "SHARP" else "use_seam", on)
    return lost


def _kept_edges(mesh, snapshot, quads):
    """int64 (edges,): for each edge of a face that stayed that edge of the surface, else -1."""
    made = np.full(len(mesh.edges), -1, np.int64)
    if not len(quads.kept):
        return made
    begin = 4 * len(quads.quads)
    edge = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", edge)
    ends = np.cumsum(snapshot.sizes)
    after = np.arange(1, 1 + len(snapshot.corners))
    after[ends - 1] = ends - snapshot.sizes
    following = quads.following[begin:] - begin
    same = quads.kept_from[following] == after[quads.kept_from]  # not the cuts of a face that is several now
    stays = (quads.vertices[quads.kept] == snapshot.local_vertices[snapshot.corners[quads.kept_from]]).all(1)
    same &= stays & stays[following]
    made[edge[begin:][same]] = snapshot.edge_of_corner[quads.kept_from[same]]
    return made


def mark_faces(mesh, snapshot, quads):
    """Of a region: its quads are selected, as the faces that they were made of were, and what was hidden around them still is."""
    if snapshot.region is None:
        return
    count, sizes = len(quads.quads), quads.sizes
    hidden = np.zeros(len(sizes), bool)
    first = np.cumsum(quads.kept_sizes) - quads.kept_sizes
    hidden[count:] = np.repeat(snapshot.hidden, snapshot.sizes)[quads.kept_from[first]]
    edge = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", edge)
    for elements, at in ((mesh.vertices, quads.corners), (mesh.edges, edge)):
        for name, is_on in (("select", np.arange(len(sizes)) < count), ("hide", ~hidden)):
            on = np.zeros(len(elements), bool)
            on[at[np.repeat(is_on, sizes)]] = True
            elements.foreach_set(name, on if name == "select" else ~on)
    mesh.polygons.foreach_set("select", np.arange(len(sizes)) < count)
    mesh.polygons.foreach_set("hide", hidden)


def _among(edges, chosen, count):
    """bool (edges,): those that are among others."""
    key = [np.sort(pairs.astype(np.int64), axis=1) @ np.array([count, 1]) for pairs in (edges, chosen)]
    return np.isin(key[0], key[1])


def _set_corners(mesh, creases):
    """Corners of a cage, vertices twice in a pair: creases of vertices, where Blender's meshes can be given some."""
    corners = creases[creases[:, 0] == creases[:, 1], 0]
    if not len(corners) or bpy.app.version < (4, 0, 0):
        return
    layer = mesh.attributes.get("crease_vert") or mesh.attributes.new("crease_vert", "FLOAT", "POINT")
    on = np.zeros(len(mesh.vertices), np.float32)
    on[corners] = 1
    layer.data.foreach_set("value", on)


def _set_creases(mesh, creases):
    if bpy.app.version >= (4, 0, 0):
        layer = mesh.attributes.get("crease_edge") or mesh.attributes.new("crease_edge", "FLOAT", "EDGE")
        layer.data.foreach_set("value", creases)
    else:
        mesh.edges.foreach_set("crease", creases)


def weights_of(snapshot, quads):
    """float32 (groups, n) of the result, or None."""
    arrays = quads.arrays
    if snapshot.weights is None:
        return None
    made = np.zeros((len(snapshot.group_names), len(quads.vertices)), np.float32)
    bones, others = split_groups(snapshot)
    if "a:weights" in arrays:
        rows = np.arange(len(quads.vertices))
        for k in range(arrays["a:weights"].reshape(len(rows), -1).shape[1]):
            np.add.at(made, (arrays["g:weights"].reshape(len(rows), -1)[:, k].astype(np.int64), rows), arrays["a:weights"].reshape(len(rows), -1)[:, k])
    for i in range(0, len(others), 16):
        if f"a:groups {i // 16}" in arrays:
            made[others[i : i + 16]] = arrays[f"a:groups {i // 16}"].reshape(len(quads.vertices), -1).T
    return made


def _set_weights(obj, weights):
    for index, group in enumerate(obj.vertex_groups):
        if index >= len(weights):
            break
        row = weights[index]
        values, inverse = np.unique(row, return_inverse=True)
        if len(values) < 64:  # masks: a call a value
            for i, value in enumerate(values):
                if value > 0:
                    group.add(np.flatnonzero(inverse == i).tolist(), float(value), "REPLACE")
            continue
        for vertex in np.flatnonzero(row > 1e-6).tolist():
            group.add([vertex], float(row[vertex]), "REPLACE")


def _set_shapes(obj, snapshot, quads, old_keys):
    """Shape keys anew: their settings, drivers and action come from the old ones."""
    if obj.data.shape_keys:
        name = obj.data.shape_keys.name
        obj.shape_key_clear()
        left = bpy.data.shape_keys.get(name)  # a copy of keys with drivers counts a user too many
        if left is not None:
            bpy.data.batch_remove([left])
    if old_keys is None or snapshot.reference_name is None:
        return
    obj.shape_key_add(name=snapshot.reference_name, from_mix=False)
    base = quads.vertices.astype(np.float32)
    blocks = {snapshot.reference_name: obj.data.shape_keys.key_blocks[0]}
    for i, (about, _) in enumerate(snapshot.shapes):
        block = obj.shape_key_add(name=about["name"], from_mix=False)
        placed = (base + quads.arrays[f"a:target:{i}"]).astype(np.float32)
        placed[quads.still] = about["placed"][quads.still_from]
        block.data.foreach_set("co", placed.reshape(-1))
        block.slider_min, block.slider_max = about["min"], about["max"]
        block.value, block.mute, block.vertex_group, block.interpolation = about["value"], about["mute"], about["group"], about["interpolation"]
        blocks[about["name"]] = block
    for about, _ in snapshot.shapes:
        if about["relative"] in blocks:
            blocks[about["name"]].relative_key = blocks[about["relative"]]
    keys = obj.data.shape_keys
    keys.use_relative, keys.eval_time = old_keys.use_relative, old_keys.eval_time
    old = old_keys.animation_data
    if old:
        new = keys.animation_data_create()
        new.action = old.action
        for curve in old.drivers:
            new.drivers.from_existing(src_driver=curve)


def dress(context, mesh, snapshot, quads, old, keep):
    """Weights and shape keys of a mesh that build() made, by an object that is gone afterwards."""
    weights = weights_of(snapshot, quads) if "WEIGHTS" in keep else None
    has_shapes = snapshot.reference_name is not None
    if weights is None and not has_shapes:
        return
    obj = bpy.data.objects.new(".quads", mesh)
    try:
        if weights is not None:
            for name in snapshot.group_names[len(obj.vertex_groups) :]:
                obj.vertex_groups.new(name=name)
            _set_weights(obj, weights)
        if has_shapes:
            _set_shapes(obj, snapshot, quads, old.shape_keys if "SHAPES" in keep else None)
    finally:
        bpy.data.objects.remove(obj)
