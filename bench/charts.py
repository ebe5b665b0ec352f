"""How charts are cut: for each mesh at 3,000 quads how many, how small, how long their seams, how far stretched, and
whether their borders lie on lines of quads. Read from the OBJ file alone, not by the library's code.

usage: charts.py QUADWRIGHT [-n FACES] [-k FOLDER] [-j FILE.json] [--options "..."] MESH...     (needs numpy)
       a MESH may be a state that `--dump-stage assemble:FILE.qws` wrote: then its quads are only unwrapped
       charts.py --compare BEFORE.json AFTER.json                                             (ratios, and means)

charts, small    charts, and those of less than 10 quads
seams            length of the seams over the root of the surface's area, borders of the surface left out
L2, worst, Linf  stretch of Sander et al. 2001, charts scaled by the one factor that makes areas equal: root of the
                 mean of (s1^2 + s2^2) / 2; that of the worst chart of 10 quads and more; 99.9 % of the area has a larger
                 singular value below Linf
used             share of the unit squares that triangles cover
twice            pairs of triangles with a common inner point, in whole numbers, exactly
lines            share of the seams' length on edges sharper than 35 degrees, or in a row of four and more that goes
                 straight through vertices of four quads
mirror           share of the seams' length that has its mirror image for a seam, about the best of the planes across
                 the axes; - where the vertices have no such plane
s                seconds of the processor, whole program"""
import json, pathlib, resource, subprocess, sys, tempfile
import numpy as np

GRID = 1 << 20
LONG, SHARP, SMALL = 4, 35, 10


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
    return np.array(places), np.rint(np.array(coords) * GRID).astype(np.int64), corners, texels


def find(into, i):
    while into[i] != i:
        into[i] = into[into[i]]
        i = into[i]
    return i


def cut(coords, corners, texels):
    """The chart of each face, and the inner edges that are seams."""
    into, half, seams = list(range(len(corners))), {}, []
    for f, (c, t) in enumerate(zip(corners, texels)):
        for k in range(len(c)):
            half[c[k - 1], c[k]] = (f, tuple(coords[t[k - 1]]), tuple(coords[t[k]]))
    for (a, b), (f, p, q) in half.items():
        other = half.get((b, a))
        if other is None:
            continue
        if other[1:] == (q, p):
            into[find(into, f)] = find(into, other[0])
        elif a < b:
            seams.append((a, b))
    return np.array([find(into, f) for f in range(len(corners))]), seams, half


def normals(places, corners):
    out = np.zeros((len(corners), 3))
    for f, c in enumerate(corners):
        p = places[c]
        out[f] = np.cross(p, np.roll(p, -1, 0)).sum(0)
    return out / np.maximum(np.linalg.norm(out, axis=1), 1e-300)[:, None]


def straight_on(corners, half):
    """(a, b) -> (b, c): the edge straight on, where b lies between four quads."""
    across, ends = {}, {}
    count, rim = np.zeros(max(map(max, corners)) + 1, int), set()
    for a, b in half:
        count[a] += 1
        if (b, a) not in half:
            rim |= {a, b}
    for (a, b), (f, *_) in half.items():
        c = corners[f]
        ends[a, b] = c[(c.index(b) + 1) % len(c)]  # the face's next vertex
    for a, b in half:
        if count[b] == 4 and b not in rim and (ends[a, b], b) in half:
            across[a, b] = (b, ends[ends[a, b], b])
    return across


def on_lines(places, corners, seams, half):
    n, onward = normals(places, corners), straight_on(corners, half)
    is_seam = set(seams) | {(b, a) for a, b in seams}
    total = good = 0
    for a, b in seams:
        length = np.linalg.norm(places[a] - places[b])
        sharp = n[half[a, b][0]] @ n[half[b, a][0]] < np.cos(np.radians(SHARP))
        row = 1
        for e in ((a, b), (b, a)):
            at = e
            while row < LONG and (at := onward.get(at)) in is_seam:
                row += 1
        total += length
        good += length * (sharp or row >= LONG)
    return total, good / total if total > 0 else 1


def mirror(places, seams):
    box = places.min(0), places.max(0)
    mid, tolerance = (box[0] + box[1]) / 2, 2e-3 * np.linalg.norm(box[1] - box[0])
    best = None
    for axis in range(3):
        cells = {}
        for i, p in enumerate(places):
            cells.setdefault(tuple(np.floor(p / tolerance).astype(int)), []).append(i)
        twin, found = {}, 0
        for i, p in enumerate(places):
            q = p.copy()
            q[axis] = 2 * mid[axis] - q[axis]
            base, near = np.floor(q / tolerance).astype(int), None
            for d in np.ndindex(3, 3, 3):
                for k in cells.get(tuple(base + d - 1), []):
                    gap = np.linalg.norm(places[k] - q)
                    if gap < tolerance and (near is None or gap < near[0]):
                        near = (gap, k)
            if near:
                twin[i], found = near[1], found + 1
        if found < 0.95 * len(places):
            continue
        is_seam = set(seams) | {(b, a) for a, b in seams}
        length = [np.linalg.norm(places[a] - places[b]) for a, b in seams]
        same = [(twin.get(a), twin.get(b)) in is_seam for a, b in seams]
        share = np.dot(length, same) / max(sum(length), 1e-300)
        best = share if best is None else max(best, share)
    return best


def pairs_twice(p):
    """p: int64[n][3][2], counter-clockwise: pairs of triangles that share an inner point. A line along a side of one of
    two convex shapes parts them, or nothing does."""
    size = max(1, int(np.ptp(p, axis=1).mean()) * 2)
    low, high = p.min(1) // size, p.max(1) // size
    cells = {}
    for i in range(len(p)):
        for x in range(low[i, 0], high[i, 0] + 1):
            for y in range(low[i, 1], high[i, 1] + 1):
                cells.setdefault((x, y), []).append(i)
    pairs = [np.stack(np.triu_indices(len(c), 1), 1) for c in cells.values()]
    pairs = [np.array(c)[q] for c, q in zip(cells.values(), pairs) if len(q)]
    pairs = np.unique(np.concatenate(pairs), axis=0)
    parted = np.zeros(len(pairs), bool)
    for one, other in ((0, 1), (1, 0)):
        a, b = p[pairs[:, one]], p[pairs[:, other]]
        for k in range(3):
            s, e = a[:, k], a[:, (k + 1) % 3] - a[:, k]
            turn = e[:, None, 0] * (b[..., 1] - s[:, None, 1]) - e[:, None, 1] * (b[..., 0] - s[:, None, 0])
            parted |= (turn <= 0).all(1)
    return int((~parted).sum())


def measure(path):
    places, coords, corners, texels = load(path)
    chart, seams, half = cut(coords, corners, texels)
    tri = np.array([(f, c[0], c[k], c[k + 1], t[0], t[k], t[k + 1])
                    for f, (c, t) in enumerate(zip(corners, texels)) for k in range(1, len(c) - 1)])
    flat = coords[tri[:, 4:]]
    u, v = places[tri[:, 2]] - places[tri[:, 1]], places[tri[:, 3]] - places[tri[:, 1]]
    p, q = ((flat[:, k] - flat[:, 0]) / GRID for k in (1, 2))
    g = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    area = np.sqrt(np.maximum(g[0] * g[2] - g[1] ** 2, 0)) / 2
    plane = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / 2
    scale = np.abs(plane).sum() / area.sum()
    h = (p * p).sum(1) / scale, (p * q).sum(1) / scale, (q * q).sum(1) / scale
    good = (plane > 0) & (area > 1e-7 * area.mean())
    # from the plane to space, as Sander has it: the inverse of the map from space to the plane
    det = np.maximum((h[0] * h[2] - h[1] ** 2)[good], 1e-300)
    trace = (h[2] * g[0] - 2 * h[1] * g[1] + h[0] * g[2])[good] / det
    ratio = (g[0] * g[2] - g[1] ** 2)[good] / det
    large = np.sqrt((trace + np.sqrt(np.maximum(trace**2 - 4 * ratio, 0))) / 2)
    weight, of = area[good], chart[tri[good, 0]]
    order = np.argsort(large)
    share = np.cumsum(weight[order]) / weight.sum()
    quads = dict(zip(*np.unique(chart, return_counts=True)))
    each = [np.sqrt(np.average(trace[of == c] / 2, weights=weight[of == c])) for c, n in quads.items() if n >= SMALL and (of == c).any()]
    length, lines = on_lines(places, corners, seams, half)
    tiles = len({tuple(t) for t in flat.reshape(-1, 2) // (GRID + 1)})
    return dict(charts=len(quads), small=int(sum(n < SMALL for n in quads.values())), seams=length / np.sqrt(area.sum()),
                l2=np.sqrt(np.average(trace / 2, weights=weight)), worst=max(each, default=1), linf=large[order][np.searchsorted(share, 0.999)],
                used=np.abs(plane).sum() / tiles, twice=pairs_twice(flat) + int((plane <= 0).sum()), lines=lines, mirror=mirror(places, seams))


HEAD = ["charts", "small", "seams", "l2", "worst", "linf", "used", "twice", "lines", "mirror", "s"]


def spent():
    """By the programs that were called."""
    all_of = resource.getrusage(resource.RUSAGE_CHILDREN)
    return all_of.ru_utime + all_of.ru_stime


def row(name, m):
    told = ["-" if m[k] is None else f"{m[k]:.0f}" if isinstance(m[k], (int, np.integer)) else f"{m[k]:.{3 if k in ('l2', 'worst') else 2}f}" for k in HEAD]
    return f"| {name} | " + " | ".join(told) + " |"


def summary(rows):
    mean = {k: float(np.mean([r[k] for r in rows.values() if r[k] is not None] or [0])) for k in HEAD}
    print(row("**mean**", mean))
    return mean


def compare(before, after):
    a, b = (json.loads(pathlib.Path(f).read_text()) for f in (before, after))
    both = [k for k in a if k in b]
    for k in both:
        print(row(k, {h: None if a[k][h] is None or b[k][h] is None else float(b[k][h]) / max(float(a[k][h]), 1e-9) for h in HEAD}))
    for rows in (a, b):
        summary({k: rows[k] for k in both})
    for h in ("charts", "seams", "s"):
        print(h, "mean of ratios", np.mean([b[k][h] / max(a[k][h], 1e-9) for k in both if a[k][h] > 0]).round(3))


def main(argv):
    if argv[0] == "--compare":
        return compare(*argv[1:])
    program, meshes, faces, keep, into, options, rows = argv.pop(0), [], "3000", None, None, [], {}
    while argv:
        word = argv.pop(0)
        if word == "-n":
            faces = argv.pop(0)
        elif word == "-k":
            keep = argv.pop(0)
        elif word == "-j":
            into = argv.pop(0)
        elif word == "--options":
            options = argv.pop(0).split()
        else:
            meshes.append(word)
    print("| mesh | " + " | ".join(HEAD) + " |\n" + "|---" * (len(HEAD) + 1) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for mesh in meshes:
            name = pathlib.Path(mesh).stem
            made, start = f"{keep or folder}/{name}.obj", spent()
            given = ["--from-stage", mesh] if mesh.endswith(".qws") else [mesh]
            subprocess.run([program, *given, "-o", made, "--faces", faces, "--no-attributes", "--unwrap", "-q", *options], check=True)
            took = spent() - start
            rows[name] = {k: v if v is None or isinstance(v, int) else float(v) for k, v in measure(made).items()} | {"s": took}
            print(row(name, rows[name]), flush=True)
            if into:
                pathlib.Path(into).write_text(json.dumps(rows))
    summary(rows)


if __name__ == "__main__":
    main(sys.argv[1:])
