"""What is kept, how long it takes and how good the quads are, beside Blender's own operator: blender -b --factory-startup -P table.py -- TABLE.md"""
import json
import os
import statistics
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy
import numpy as np

import character
import common
from common import fresh, module, places, read

FACES = 4000
RUNS = 3


def own(obj):
    """Blender's operator with the same number of faces."""
    begun = time.monotonic()
    try:
        result = bpy.ops.object.quadriflow_remesh(mode="FACES", target_faces=FACES, seed=0, use_preserve_sharp=True, use_preserve_boundary=True)
    except RuntimeError as error:
        return time.monotonic() - begun, str(error).strip()
    return time.monotonic() - begun, sorted(result)[0]


def ours(obj):
    worker = module("state").live_child()
    while worker.keys:  # a surface that it has not seen
        worker.send({"kind": "forget", "key": worker.keys.pop()})
    begun = time.monotonic()
    try:
        result = common.remesh()
    except RuntimeError as error:
        return time.monotonic() - begun, str(error).strip()
    return time.monotonic() - begun, sorted(result)[0]


def figures(obj, surface):
    """Of the mesh as it is: measured by numpy alone."""
    mesh = obj.data
    sizes = read(mesh.polygons, "loop_total", np.int32)
    if not (sizes == 4).all():
        return None
    points, quads = places(mesh), read(mesh.loops, "vertex_index", np.int32).reshape(-1, 4)
    corners = points[quads]
    before, after = np.roll(corners, 1, 1) - corners, np.roll(corners, -1, 1) - corners
    cosine = (before * after).sum(-1) / np.maximum(np.linalg.norm(before, axis=-1) * np.linalg.norm(after, axis=-1), 1e-30)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    fewer, more = module("overlay").irregular(mesh)
    lengths = common.edge_lengths(obj)
    from mathutils.bvhtree import BVHTree

    tree = BVHTree.FromPolygons(points.tolist(), quads.tolist())
    far = np.array([tree.find_nearest(p)[3] for p in surface[:: max(1, len(surface) // 4000)].tolist()])
    return {
        "quads": len(quads),
        "irregular": len(fewer) + len(more),
        "angle": float(np.sqrt(((angle - 90) ** 2).mean())),
        "area": float(areas.std() / areas.mean()),
        "far": float(far.mean() / lengths.mean()),
        "farthest": float(far.max() / lengths.mean()),
    }


def objects():
    """[(name, function that makes it)]."""

    def subdivided():
        return common.suzanne(3, True)

    def ball():
        return common.bumpy_sphere(320, 158)

    def open_grid():
        obj = common.grid(120)
        points = places(obj.data)
        points[:, 2] = 0.2 * np.sin(3 * points[:, 0]) * np.cos(2 * points[:, 1])
        obj.data.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
        return obj

    def messy():
        """As it comes from elsewhere: triangles turned over, loose and doubled vertices, two sheets through an edge."""
        obj = common.suzanne(2, True)
        rng = np.random.default_rng(1)
        corners = read(obj.data.loops, "vertex_index", np.int32)
        import bmesh

        bm = bmesh.new()
        bm.from_mesh(obj.data)
        bm.faces.ensure_lookup_table()
        bmesh.ops.reverse_faces(bm, faces=[bm.faces[i] for i in rng.choice(len(bm.faces), 300, replace=False)])
        bmesh.ops.split_edges(bm, edges=[e for i, e in enumerate(bm.edges) if i % 9 == 0])
        bm.to_mesh(obj.data)
        bm.free()
        return obj

    return [
        ("character", lambda: character.make()[0]),
        ("Suzanne, 63,000 triangles", subdivided),
        ("bumpy ball, 100,000 triangles", ball),
        ("open sheet", open_grid),
        ("Suzanne, faces turned over, edges split", messy),
    ]


def measured(make, run):
    """(seconds, what it answered, figures or None, what is kept or None)."""
    seconds = []
    for _ in range(RUNS):
        settings = fresh()
        settings.target, settings.faces = "FACES", FACES
        obj = make()
        surface = places(obj.data)
        before = common.state_of(obj)
        taken, answer = run(obj)
        seconds.append(taken)
    changed = common.state_of(obj) != before
    kept = character.kept(obj) if obj.name == "Character" else None
    return statistics.median(seconds), answer, figures(obj, surface) if changed else None, kept


def error(row):
    there, most, mean = row
    if not there:
        return "lost"
    if most is None:
        return "kept"
    return f"kept, off by {mean:.1e} on average, {most:.1e} at most" if mean is not None else f"kept, off by {most:.1e}"


def main(path):
    common.install()
    common.remesh() if fresh() and common.grid(10) else None  # the worker is there
    lines, failed = [], 0
    rows = [(name, measured(make, ours), measured(make, own)) for name, make in objects()]
    lines += ["| of the character | Quick Remesh to Quads | QuadriFlow in Blender |", "|---|---|---|"]
    mine, theirs = rows[0][1][3], rows[0][2][3]
    for what in mine:
        lines.append(f"| {what} | {error(mine[what])} | {error(theirs.get(what, (False, None, None)))} |")
        failed += not mine[what][0]
    lines += [
        "",
        f"| object | operator | seconds | quads ({FACES:,} asked for) | irregular | angles off, degrees | areas off "
        "| surface to quads, mean / most, edges | answer |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, *both in rows:
        for who, (seconds, answer, f, _) in zip(("Quick Remesh to Quads", "QuadriFlow"), both):
            if f is None:
                lines.append(f"| {name} | {who} | {seconds:.2f} | unchanged | | | | | {answer} |")
                failed += who != "QuadriFlow"
            else:
                lines.append(
                    f"| {name} | {who} | {seconds:.2f} | {f['quads']:,} | {f['irregular']} | {f['angle']:.1f} | {100 * f['area']:.0f} % "
                    f"| {f['far']:.3f} / {f['farthest']:.2f} | {answer} |"
                )
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")
    print("table ... " + ("ok" if not failed else "FAIL"))
    print("\n".join(lines))
    print(json.dumps({"ran": 1, "failed": int(bool(failed))}), flush=True)
    module("state").stop_child()


main(sys.argv[sys.argv.index("--") + 1])
