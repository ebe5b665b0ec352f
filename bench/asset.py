"""Texture coordinates by Quadwright and by Blender's Smart UV Project on the same quads: charts, stretch, share of the square, overlaps.

usage: asset.py QUADWRIGHT MESH... [--faces N]   (needs Debian's blender and numpy; writes a table to standard output)
       asset.py --maps QUADWRIGHT MESH...         (what `quadwright asset` says of itself at 3,000 quads, 2048 texels)

Measured on the OBJ files alone, by the metric of each triangle and by pixels, not by the library's code."""
import json, pathlib, subprocess, sys, tempfile
import numpy as np

SMART = """
import bpy, sys
source, target = sys.argv[sys.argv.index('--') + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=source)
bpy.context.view_layer.objects.active = bpy.context.selected_objects[0]
bpy.ops.object.mode_set(mode='EDIT')
bpy.ops.mesh.select_all(action='SELECT')
bpy.ops.uv.smart_project(island_margin=0.002)
bpy.ops.object.mode_set(mode='OBJECT')
bpy.ops.wm.obj_export(filepath=target, export_materials=False, export_normals=False, apply_modifiers=False)
"""


def load(path):
    places, coords, corners, texels = [], [], [], []
    for line in open(path):
        word, *rest = line.split() or ["#"]
        if word == "v":
            places.append([float(x) for x in rest[:3]])
        elif word == "vt":
            coords.append([float(x) for x in rest[:2]])
        elif word == "f":
            pairs = [r.split("/") for r in rest]
            corners.append([int(p[0]) - 1 for p in pairs])
            texels.append([int(p[1]) - 1 for p in pairs])
    return np.array(places), np.array(coords), corners, texels


def count_charts(coords, corners, texels):
    into = list(range(len(corners)))

    def find(i):
        while into[i] != i:
            into[i] = into[into[i]]
            i = into[i]
        return i

    edges = {}
    for f, (c, t) in enumerate(zip(corners, texels)):
        for k in range(len(c)):
            a, b, p, q = c[k], c[k - 1], tuple(coords[t[k]]), tuple(coords[t[k - 1]])
            key = (a, b, p, q) if a < b else (b, a, q, p)
            if key in edges:
                into[find(f)] = find(edges[key])
            edges[key] = f
    return len({find(f) for f in range(len(corners))})


def measure(path, size=2048):
    places, coords, corners, texels = load(path)
    charts = count_charts(coords, corners, texels)
    tri = [(c[0], c[k], c[k + 1], t[0], t[k], t[k + 1]) for c, t in zip(corners, texels) for k in range(1, len(c) - 1)]
    tri = np.array(tri)
    u, v = places[tri[:, 1]] - places[tri[:, 0]], places[tri[:, 2]] - places[tri[:, 0]]
    p, q = coords[tri[:, 4]] - coords[tri[:, 3]], coords[tri[:, 5]] - coords[tri[:, 3]]
    g = np.stack([(u * u).sum(1), (u * v).sum(1), (v * v).sum(1)])
    area = np.sqrt(np.maximum(g[0] * g[2] - g[1] ** 2, 0)) / 2
    flat = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / 2
    scale = np.abs(flat).sum() / area.sum()
    h = np.stack([(p * p).sum(1), (p * q).sum(1), (q * q).sum(1)]) / scale
    good = (area > 1e-7 * area.mean()) & (np.abs(flat) > 0)
    trace = (g[2] * h[0] - 2 * g[1] * h[1] + g[0] * h[2])[good] / (4 * area[good] ** 2)
    ratio = np.abs(flat[good]) / scale / area[good]
    s1 = np.sqrt((trace + np.sqrt(np.maximum(trace**2 - 4 * ratio**2, 0))) / 2)
    weight = area[good] / area[good].sum()
    angle, sizes = (weight * s1**2 / ratio).sum(), (weight * np.maximum(ratio, 1 / ratio)).sum()
    hits = np.zeros((size, size), np.uint8)
    for t in tri:
        paint(hits, coords[t[3:]] * size)
    return charts, angle, sizes, (hits > 0).mean(), int((hits > 1).sum()), int((flat <= 0).sum())


def paint(hits, p):
    x0, y0 = np.maximum(np.floor(p.min(0)).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(p.max(0)).astype(int), hits.shape[0] - 1)
    x, y = np.meshgrid(np.arange(x0, x1 + 1) + 0.5, np.arange(y0, y1 + 1) + 0.5)
    inside, n = np.ones(x.shape, bool), 0
    d = (p[1, 0] - p[0, 0]) * (p[2, 1] - p[0, 1]) - (p[1, 1] - p[0, 1]) * (p[2, 0] - p[0, 0])
    for k in range(3):
        a, b = p[k], p[(k + 1) % 3]
        e = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) * np.sign(d)
        inside &= e > 1e-6 * size_of(p)
    hits[y0 : y1 + 1, x0 : x1 + 1] += inside


def size_of(p):
    return float(np.abs(p.max(0) - p.min(0)).max()) + 1e-12


def maps(program, meshes):
    print("| mesh | charts before | charts | overlapping | angle | area | used | missed | normals (degrees) | colours |\n|---|---|---|---|---|---|---|---|---|---|")
    for mesh in meshes:
        with tempfile.TemporaryDirectory() as folder:
            command = [program, "asset", mesh, "-o", f"{folder}/a.glb", "--faces", "3000", "--texture", "2048", "--json", f"{folder}/a.json", "-q"]
            subprocess.run(command, check=True)
            a = json.loads(pathlib.Path(f"{folder}/a.json").read_text())["asset"]
        told = [a["charts_before"] or "", a["charts"], a["overlapping_charts"], f"{a['angle_stretch']:.3f}", f"{a['area_stretch']:.3f}", f"{a['used']:.1%}",
                f"{a['missed_texels'] / a['texels']:.2%}", f"{a['normal_error']:.2f}", "" if a["color_error"] is None else f"{a['color_error']:.2f}"]
        print(f"| {pathlib.Path(mesh).stem} | " + " | ".join(map(str, told)) + " |", flush=True)


def main(argv):
    if argv[0] == "--maps":
        return maps(argv[1], argv[2:])
    faces = argv[argv.index("--faces") + 1] if "--faces" in argv else "5000"
    program, meshes = argv[0], [a for a in argv[1:] if a not in ("--faces", faces)]
    print("| mesh | charts | angle | area | used | texels twice | Blender: charts | angle | area | used | texels twice |\n|---|---|---|---|---|---|---|---|---|---|---|")
    for mesh in meshes:
        with tempfile.TemporaryDirectory() as folder:
            ours, theirs, script = (f"{folder}/{n}" for n in ("ours.obj", "theirs.obj", "smart.py"))
            pathlib.Path(script).write_text(SMART)
            subprocess.run([program, mesh, "-o", ours, "--faces", faces, "--no-attributes", "--unwrap", "-q"], check=True)
            subprocess.run(["blender", "-b", "-P", script, "--", ours, theirs], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            row = [f"{c} | {a:.3f} | {s:.3f} | {u:.1%} | {d}" for c, a, s, u, d, _ in (measure(ours), measure(theirs))]
        print(f"| {pathlib.Path(mesh).stem} | {row[0]} | {row[1]} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
