#!/usr/bin/python3
"""Rings beside a drawn loop. usage: bench/rings.py QUADWRIGHT [RINGS [FACES]]
Balls, eggs and heads, each with circles and ovals of four sizes around z and `g rings N`: how many closed edge loops of as many edges as the
loop itself lie on each side of it, as a share of N. Needs numpy."""
import os, subprocess, sys, tempfile
import numpy as np

STEPS, DRAWN = 40, 16  # steps of the surface, points of a loop


def cube_sphere(n):
    points, faces, index = [], [], {}
    t = np.tan((np.arange(n + 1) / n - 0.5) * np.pi / 2)

    def vertex(p):
        key = tuple(np.round(p, 9) + 0.0)
        if key not in index: index[key] = len(points); points.append(p)
        return index[key]

    for axis in range(3):
        for side in (-1, 1):
            grid = np.zeros((n + 1, n + 1), int)
            for i in range(n + 1):
                for j in range(n + 1):
                    p = np.zeros(3)
                    p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, t[i], t[j] * side
                    grid[i, j] = vertex(p / np.linalg.norm(p))
            for i in range(n):
                for j in range(n):
                    a, b, c, d = grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]
                    faces += [(a, b, c), (a, c, d)]
    return np.array(points), np.array(faces)


def head(p, depth, socket):
    x, y, z = p.T
    bumps, t = 0.04 * np.sin(5 * x) * np.cos(4 * y) * np.cos(3 * z), np.arccos(np.clip(z, -1, 1)) / socket
    r = 1 + bumps - np.where(t < 1, depth * (1 - t * t) ** 2, 0)
    return np.stack([r * x, 1.2 * r * y, r * z], 1)


SHAPES = {
    "ball": lambda p: p,
    "egg": lambda p: p * (0.8, 1.3, 0.9),
    "flat": lambda p: p * (1, 1, 0.4),
    "socket": lambda p: head(p, 0.35, 0.5),
    "nose": lambda p: head(p, -0.5, 0.6),
    "lumps": lambda p: p * (1 + 0.12 * np.sin(4 * p[:, :1] + 1) * np.cos(3 * p[:, 1:2]) + 0.1 * np.sin(5 * p[:, 2:])),
}


def loop(angle, oval, count):
    a = 2 * np.pi * np.arange(count) / count
    t = angle * (1 + oval * np.cos(2 * a))
    return np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)], 1)


def polar(p): return np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2]).mean()


def read(path):
    rows = [line.split() for line in open(path)]
    points = np.array([r[1:4] for r in rows if r and r[0] == "v"], float)
    return points, [[int(x) - 1 for x in r[1:]] for r in rows if r and r[0] == "f"]


def rings(path):
    """(mean polar angle, edges) of the loops that go straight on, close and wind once around z, from the pole outward."""
    points, quads = read(path)
    ahead = {(q[i], q[(i + 1) % 4]): (q[(i + 1) % 4], q[(i + 2) % 4]) for q in quads for i in range(4)}
    degree = np.bincount([a for a, _ in ahead], minlength=len(points))
    seen, found = set(), []
    for start in ahead:
        at, turn, walked = start, 0.0, []
        while at not in seen and at is not None:
            seen.add(at), walked.append(at)
            (ax, ay), (bx, by) = points[at[0], :2], points[at[1], :2]
            turn += (np.arctan2(by, bx) - np.arctan2(ay, ax) + np.pi) % (2 * np.pi) - np.pi
            at = ahead.get(ahead[at][::-1]) if degree[at[1]] == 4 else None
        if at == start and abs(turn - 2 * np.pi) < 1e-6: found.append((polar(points[[a for a, _ in walked]]), len(walked)))
    return sorted(found)


def write(path, points, faces=(), lines=""):
    with open(path, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % tuple(p) for p in points)
        out.writelines("f %d %d %d\n" % tuple(f + 1) for f in faces)
        out.write(lines)


def main():
    program, wanted, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 4, sys.argv[3] if len(sys.argv) > 3 else "3000"
    points, faces = cube_sphere(STEPS)
    shares = []
    with tempfile.TemporaryDirectory() as folder:
        surface, guide, result = (os.path.join(folder, n) for n in ("in.obj", "guide.obj", "out.obj"))
        for name, shape in SHAPES.items():
            write(surface, shape(points), faces)
            for angle in (0.3, 0.45, 0.64, 0.9):
                for oval in (0, 0.2):
                    numbers = " ".join(map(str, [*range(1, DRAWN + 1), 1]))
                    write(guide, shape(loop(angle, oval, DRAWN)), lines=f"g rings {wanted}\nl {numbers}\n")
                    subprocess.run([program, surface, "-o", result, "--faces", count, "--guides", guide, "--symmetry", "none", "-q"], check=True)
                    found, drawn = rings(result), polar(shape(loop(angle, oval, 64)))
                    inside = outside = 0
                    if found:
                        middle = min(range(len(found)), key=lambda i: abs(found[i][0] - drawn))
                        edges = found[middle][1]
                        while middle - inside > 0 and found[middle - inside - 1][1] == edges: inside += 1
                        while middle + outside + 1 < len(found) and found[middle + outside + 1][1] == edges: outside += 1
                    shares.append((min(inside, wanted) / wanted, min(outside, wanted) / wanted))
                    print(f"{name:8} {angle:.2f} {'oval' if oval else 'circle':7} inside {inside:3} outside {outside:3}", flush=True)
    inside, outside = np.mean(shares, 0)
    print(f"{len(shares)} loops, {wanted} rings asked for on each side: inside {inside:.2f}, outside {outside:.2f}")


main()
