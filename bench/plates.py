#!/usr/bin/python3
"""Plates and blocks with round holes, preset cad: edges around each circle, and how straight rows are on planes.

usage: plates.py PROGRAM [--counts 500,1500,5000] [--keep FOLDER] [OPTION...]
Twenty random plates (one to eight holes, 0.2 to 2.5 thick; wants NumPy and SciPy) are remeshed as
`PROGRAM PLATE -o RESULT --preset cad --faces N OPTION...`. A row a count: circles with 12 edges, those with fewer and no note,
odd ones, the mean turn of a line at regular vertices of planes with no hole within five quads, medians of angle and distance.

       plates.py --turn MESH...
The mean turn alone, of any quads."""
import json
import subprocess
import sys
import tempfile

import numpy
from scipy.sparse import coo_matrix, csgraph
from scipy.spatial import Delaunay

FAR = 5          # quads between a vertex and the next hole
SAME_PLANE = .999  # cosine between the normals of quads of one plane


def plate(generator, path):
    """Writes one plate; returns its circles: middle, radius, height."""
    wide, high, thick = generator.uniform(4, 12), generator.uniform(3, 8), generator.uniform(.2, 2.5)
    wanted, sides = generator.integers(1, 9), int(generator.choice([16, 24, 32, 48, 64]))
    holes = []
    for _ in range(400):
        r = float(numpy.exp(generator.uniform(numpy.log(.12), 0)))
        room = 1.5 * r + .1
        if len(holes) == wanted or wide < 2 * room or high < 2 * room:
            continue
        x, y = generator.uniform(room, wide - room), generator.uniform(room, high - room)
        if all(numpy.hypot(x - a, y - b) > 1.3 * (r + c) + .1 for a, b, c in holes):
            holes.append((x, y, r))
    line = numpy.arange(24) / 24
    places = [numpy.c_[wide * line, 0 * line], numpy.c_[wide + 0 * line, high * line], numpy.c_[wide - wide * line, high + 0 * line], numpy.c_[0 * line, high - high * line]]
    turn = 2 * numpy.pi * numpy.arange(sides) / sides
    places += [numpy.c_[x + r * numpy.cos(turn), y + r * numpy.sin(turn)] for x, y, r in holes]
    grid = numpy.array([(u, v) for u in numpy.linspace(0, wide, 14)[1:-1] for v in numpy.linspace(0, high, 10)[1:-1]])
    places.append(grid[[all(numpy.hypot(u - x, v - y) > 1.25 * r for x, y, r in holes) for u, v in grid]])
    flat = numpy.concatenate(places)
    ring = numpy.full(len(flat), -1)
    for i in range(len(holes)):
        ring[96 + i * sides:96 + (i + 1) * sides] = i
    faces = Delaunay(flat).simplices
    inside = (ring[faces[:, 0]] >= 0) & (ring[faces] == ring[faces[:, :1]]).all(1)
    a, b, c = (flat[faces[:, i]] for i in range(3))
    area = numpy.cross(b - a, c - a)
    faces, area = faces[~inside & (abs(area) > 1e-9)], area[~inside & (abs(area) > 1e-9)]
    faces[area < 0] = faces[area < 0][:, ::-1]
    edges = {(f[i], f[(i + 1) % 3]) for f in faces for i in range(3)}
    n = len(flat)
    sides = [t for p, q in edges if (q, p) not in edges for t in ((q, p, p + n), (q, p + n, q + n))]
    with open(path, "w") as file:
        for z in (thick, 0):
            file.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y in flat)
        for f in [*faces, *(faces[:, ::-1] + n), *sides]:
            file.write("f %d %d %d\n" % tuple(i + 1 for i in f))
    return [(x, y, r, z) for x, y, r in holes for z in (0, thick)]


def read(path):
    with open(path) as file:
        lines = [line.split() for line in file]
    vertices = numpy.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    return vertices, numpy.array([[int(word.split("/")[0]) - 1 for word in line[1:5]] for line in lines if line[:1] == ["f"]])


def planes(places, quads):
    """Which plane each quad lies on: joined where neighbours have one normal."""
    diagonals = places[quads[:, 2]] - places[quads[:, 0]], places[quads[:, 3]] - places[quads[:, 1]]
    normal = numpy.cross(*diagonals)
    normal /= numpy.maximum(numpy.linalg.norm(normal, axis=1), 1e-30)[:, None]
    owner, pairs = {}, []
    for f, quad in enumerate(quads):
        for i in range(4):
            p, q = quad[i], quad[(i + 1) % 4]
            other = owner.setdefault((min(p, q), max(p, q)), f)
            if other != f and normal[f] @ normal[other] > SAME_PLANE:
                pairs.append((f, other))
    rows, columns = numpy.array(pairs).reshape(-1, 2).T
    plane = csgraph.connected_components(coo_matrix((numpy.ones(len(rows)), (rows, columns)), (len(quads),) * 2))[1]
    for k in numpy.unique(plane):  # a surface that bends slowly is no plane
        mean = normal[plane == k].sum(0)
        if (normal[plane == k] @ mean).min() < SAME_PLANE * numpy.linalg.norm(mean):
            plane[plane == k] = -1
    return plane


def turns(places, quads):
    """The turns, in degrees, of both lines at each regular vertex of a plane with no hole near."""
    plane, around = planes(places, quads), {}
    for f, quad in enumerate(quads):
        for i in range(4):
            around.setdefault(quad[i], []).append((f, quad[(i + 1) % 4], quad[(i + 3) % 4]))
    graph = {v: {q for _, a, b in corners for q in (a, b)} for v, corners in around.items()}
    found = []
    for k in numpy.unique(plane[plane >= 0]):
        members = numpy.flatnonzero(plane == k)
        if len(members) < 9:
            continue
        sides = {(quads[f][i], quads[f][(i + 1) % 4]) for f in members for i in range(4)}
        rim = numpy.array([(p, q) for p, q in sides if (q, p) not in sides])
        if not len(rim):
            continue
        ends, index = numpy.unique(rim, return_inverse=True)
        index = index.reshape(-1, 2)
        loop = csgraph.connected_components(coo_matrix((numpy.ones(len(rim)), index.T), (len(ends),) * 2))[1]
        span = [numpy.ptp(places[ends[loop == i]], axis=0).max() for i in range(loop.max() + 1)]
        near = set(ends[loop != numpy.argmax(span)])
        for _ in range(FAR):
            near |= {q for v in near for q in graph[v]}
        for v in set(quads[members].ravel()) - set(ends) - near:
            if len(around[v]) != 4:
                continue
            follow = {a: b for _, a, b in around[v]}
            a = around[v][0][1]
            for p in (a, follow[a]):
                one, two = places[v] - places[p], places[follow[follow[p]]] - places[v]
                found.append(numpy.degrees(numpy.arctan2(numpy.linalg.norm(numpy.cross(one, two)), one @ two)))
    return found


def edges_around(places, circle):
    x, y, r, z = circle
    on = abs(numpy.hypot(places[:, 0] - x, places[:, 1] - y) - r) < .02 * r
    return int((on & (abs(places[:, 2] - z) < .02)).sum())


def numbers(tree):
    """All numbers of nested objects, by their names."""
    found = {}
    for name, value in tree.items():
        found.update(numbers(value) if isinstance(value, dict) else {name: value} if isinstance(value, (int, float)) else {})
    return found


def main(program, options):
    counts, keep = [500, 1500, 5000], None
    while options and options[0] in ("--counts", "--keep"):
        if options[0] == "--counts":
            counts = [int(n) for n in options[1].split(",")]
        else:
            keep = options[1]
        options = options[2:]
    folder = keep or tempfile.mkdtemp()
    generator = numpy.random.default_rng(7)
    plates = [plate(generator, f"{folder}/plate{i}.obj") for i in range(20)]
    print("| quads | circles of 12 | fewer, no note | odd | turn | angle | distance | count |\n|---|---|---|---|---|---|---|---|")
    for count in counts:
        edges, silent, turned, rows = [], 0, [], []
        for i, circles in enumerate(plates):
            result, report = f"{folder}/plate{i}-{count}.obj", f"{folder}/report.json"
            subprocess.run([program, f"{folder}/plate{i}.obj", "-o", result, "-q", "--preset", "cad", "--faces", str(count), "--json", report, *options], check=True)
            with open(report) as file:
                said = json.load(file)
            places, quads = read(result)
            found = [edges_around(places, circle) for circle in circles]
            if min(found) < 12 and not any("edges around" in note for note in said["report"]["warnings"]):
                silent += sum(n < 12 for n in found)
            edges += found
            turned.append(turns(places, quads))
            rows.append({**numbers(said), "count": abs(len(quads) / count - 1)})
        flat = [t for one in turned for t in one]
        middle = [numpy.median([row[name] for row in rows]) for name in ("angle_rms", "chamfer")]
        print(f"| {count} | {sum(n >= 12 for n in edges)} of {len(edges)} | {silent} | {sum(n % 2 for n in edges)} | {numpy.mean(flat or 0):.2f} of {len(flat)} "
              f"| {middle[0]:.2f} | {middle[1]:.5f} | {max(row['count'] for row in rows):.3f} |", flush=True)
        print("   ", " ".join(f"{numpy.mean(one):.2f}" if one else "-" for one in turned), file=sys.stderr, flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--turn":
        for name in sys.argv[2:]:
            found = turns(*read(name))
            print(name, f"{numpy.mean(found or 0):.2f} of {len(found)}, largest {max(found, default=0):.1f}")
    else:
        main(sys.argv[1], sys.argv[2:])
