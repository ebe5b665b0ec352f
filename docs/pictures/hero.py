#!/usr/bin/python3
"""README's first picture, docs/pictures/hero.png: a face, a creature, a machine part and a garment, each beside its quads.

usage: docs/pictures/hero.py [PROGRAM]
The surfaces are made here: signed distances, contoured with a vertex a cell where the tangent planes of its crossings meet (Ju et al. 2002).
Wants NumPy."""
import os
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def ball(p, c, r):
    """An ellipsoid of radii r, or a ball."""
    q = (p - np.array(c)) / np.array(r)
    n = np.linalg.norm(q, axis=-1)
    return n * (n - 1) / np.maximum(np.linalg.norm(q / np.array(r), axis=-1), 1e-9)


def rod(p, a, b, r, s=None):
    """A capsule from a to b, of radius r there and s here."""
    a, d = np.array(a), np.array(b) - np.array(a)
    t = np.clip((p - a) @ d / (d @ d), 0, 1)
    return np.linalg.norm(p - a - t[..., None] * d, axis=-1) - (r + t * ((r if s is None else s) - r))


def path(p, points, radii, k):
    return join(k, *(rod(p, a, b, r, s) for a, b, r, s in zip(points, points[1:], radii, radii[1:])))


def join(k, *all):
    """A union whose creases are filled with radius k."""
    f = all[0]
    for g in all[1:]:
        h = np.maximum(k - abs(f - g), 0) / k
        f = np.minimum(f, g) - h * h * h * k / 6
    return f


def cut(k, f, g):
    return -join(k, -f, g)


def mirrored(p):
    return np.concatenate([abs(p[..., :1]), p[..., 1:]], -1)


def face(p):
    p = mirrored(p)
    eye, lid = (.27, .05, .55), ball(p, (.27, .05, .55), .19)
    x, y = p[..., 0] - eye[0], p[..., 1] - eye[1]
    slit = np.maximum(abs(y + .05 * x - .005) - .075 * (1 - (x / .15) ** 2), .6 - p[..., 2])
    head = join(.35, ball(p, (0, .36, -.12), (.7, .76, .86)), ball(p, (0, -.4, .2), (.47, .62, .52)), ball(p, (.33, -.2, .44), (.19, .15, .19)))
    head = join(.18, head, path(p, [(0, .2, .68), (.2, .235, .65), (.4, .21, .5)], [.075, .085, .07], .1), ball(p, (0, -.84, .6), (.17, .14, .14)))
    head = cut(.16, head, ball(p, (.27, .045, .85), (.15, .11, .16)))
    head = join(.12, head, path(p, [(0, .2, .68), (0, -.05, .84), (0, -.2, .91)], [.06, .07, .085], .1))
    head = join(.06, head, ball(p, (.09, -.23, .82), (.07, .06, .085)))
    head = cut(.04, head, ball(p, (.06, -.3, .85), (.03, .035, .05)))
    head = join(.09, head, cut(.06, lid, slit))
    head = join(.03, head, ball(p, eye, .15))
    head = join(.07, head, path(p, [(0, -.495, .745), (.05, -.485, .75), (.2, -.535, .63)], [.042, .048, .015], .03))
    head = join(.05, head, path(p, [(0, -.6, .735), (.09, -.595, .715), (.2, -.545, .63)], [.06, .052, .015], .03))
    head = cut(.025, head, path(p, [(0, -.542, .815), (.1, -.542, .775), (.22, -.54, .66)], [.02, .018, .008], .02))
    ear = cut(.06, ball(p, (.73, -.02, -.08), (.085, .25, .15)), ball(p, (.83, .02, -.03), (.07, .15, .08)))
    head = join(.1, head, ear)
    neck = path(p, [(0, -.4, -.18), (0, -1.15, -.26), (0, -1.5, -.24)], [.44, .38, .44], .3)
    return np.maximum(join(.18, head, neck), -1.25 - p[..., 1])


def creature(p):
    bent = p.copy()
    bent[..., 0] -= .3 * np.sin(1.1 * (p[..., 2] + .5)) * (p[..., 2] < -.5) * np.clip(-.5 - p[..., 2], 0, 1)
    m = mirrored(bent)
    body = path(m, [(0, .62, 1.25), (0, .5, .75), (0, .36, .3), (0, .38, -.35), (0, .34, -.8)], [.17, .2, .34, .38, .26], .2)
    tail = path(m, [(0, .34, -.8), (0, .22, -1.4), (0, .16, -2), (0, .3, -2.6)], [.24, .15, .09, .03], .15)
    head = join(.12, ball(m, (0, .72, 1.42), (.23, .2, .27)), path(m, [(0, .68, 1.5), (0, .64, 1.86)], [.17, .1], .1))
    head = join(.06, head, rod(m, (.1, .83, 1.56), (.16, .8, 1.4), .055))
    head = cut(.03, head, path(m, [(0, .585, 1.99), (.13, .59, 1.72), (.19, .63, 1.55)], [.015, .018, .008], .02))
    head = cut(.025, head, ball(m, (.05, .71, 1.94), .025))
    head = np.minimum(head, ball(m, (.165, .775, 1.53), .055))
    head = join(.05, head, path(m, [(.12, .86, 1.34), (.2, 1.02, 1.15), (.22, 1.16, .88)], [.07, .05, .012], .05))
    all = join(.15, body, tail, head)
    front = path(m, [(.24, .3, .42), (.5, .2, .52), (.46, -.3, .4), (.48, -.55, .56)], [.17, .13, .09, .08], .1)
    back = path(m, [(.24, .36, -.5), (.52, .22, -.36), (.5, -.12, -.72), (.48, -.55, -.58)], [.24, .2, .11, .085], .12)
    all = join(.14, all, front, back)
    for x, z in ((.48, .56), (.48, -.58)):
        all = join(.05, all, *(rod(m, (x, -.57, z), (x + a, -.6, z + .24 - abs(a)), .06, .035) for a in (-.12, 0, .12)))
    for z, y, r in ((.55, .68, .1), (.25, .72, .15), (-.08, .78, .18), (-.42, .76, .17), (-.74, .62, .13), (-1.06, .47, .1), (-1.36, .38, .07)):
        all = join(.05, all, path(m, [(0, y - .12, z), (0, y + r, z - .1)], [.07, .015], .03))
    return all


def part(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    r, angle = np.hypot(x, z), np.arctan2(z, x)
    sector = (angle + np.pi / 6) % (np.pi / 3) - np.pi / 6
    u, v = r * np.cos(sector), r * np.sin(sector)
    foot = np.maximum(np.maximum(r - 1.4, abs(y) - .14), -(np.hypot(u - .92, v) - .15))
    turned = (angle + np.pi / 3) % (np.pi / 3) - np.pi / 6
    a, b = r * np.cos(turned), r * np.sin(turned)
    rib = np.maximum(np.maximum(abs(b) - .07, .3 - a), np.maximum((a - .95 + .42 * (y - .14)) * .92, np.maximum(-y, y - .95)))
    boss = np.maximum(r - .56, np.maximum(y - 1.15, -y))
    all = np.minimum(join(.16, foot, boss), rib)
    bore = np.minimum(np.maximum(r - .34, -(r - 2)), np.maximum(np.maximum(abs(x) - .08, -z), z - .42))
    all = np.maximum(all, -bore)
    return np.maximum(all, -np.maximum(r - .44, .95 - y))


def garment(p):
    m = mirrored(p)
    x, y, z = m[..., 0], m[..., 1], m[..., 2]
    around = np.arctan2(p[..., 2], p[..., 0])
    low = np.clip((.1 - y) / 1.3, 0, 1)
    wide = .44 + .05 * np.clip(y, -1, 1) + .62 * low ** 1.3 + low * (.075 * np.sin(9 * around + 2 * y) + .03 * np.sin(4 * around - y))
    deep = .75 + .1 * low
    torso = (np.hypot(x, z / deep) - wide) * .8
    top = ball(m, (0, .5, 0), (.55, .5, .36))
    torso = join(.45, np.maximum(torso, y - .3), top)
    sleeve = rod(m, (.36, .72, 0), (.98, .18, .02), .2, .25) + .018 * np.sin(14 * (x - y)) * np.clip(x - .4, 0, 1)
    return join(.12, torso, sleeve)


def keep_garment(p):
    m = mirrored(p)
    along = (m - np.array((.36, .72, 0))) @ np.array((.754, -.657, .024))
    neck = ball(m, (0, .93, .08), (.23, .2, .25))
    return np.maximum(np.maximum(-1.3 - p[..., 1], np.where((m[..., 0] > .62) & (m[..., 1] > -.25), along - .62, -1)), -neck)


def contour(f, low, high, step, keep=None):
    low, high = np.array(low), np.array(high)
    size = np.ceil((high - low) / step).astype(int) + 1
    at = lambda i: low + step * i
    value = np.empty(size)
    for i in range(size[0]):
        value[i] = f(at(np.stack(np.meshgrid([i], np.arange(size[1]), np.arange(size[2]), indexing="ij"), -1))[0])
    inside = value < 0
    cells = [size[0] - 1, size[1] - 1, size[2] - 1]
    number = lambda i: (i[..., 0] * cells[1] + i[..., 1]) * cells[2] + i[..., 2]
    count = np.prod(cells)
    matrix, right, middle, hits, quads = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count), []
    for axis in range(3):
        one = np.eye(3, dtype=int)[axis]
        a = np.argwhere(np.diff(inside.astype(np.int8), axis=axis) != 0)
        first, last = value[tuple(a.T)], value[tuple((a + one).T)]
        lo, hi, flip = np.zeros(len(a)), np.ones(len(a)), first > 0
        for _ in range(12):
            t = .5 * (lo + hi)
            behind = (f(at(a + t[:, None] * one)) > 0) == flip
            lo, hi = np.where(behind, t, lo), np.where(behind, hi, t)
        q = at(a + (.5 * (lo + hi))[:, None] * one)
        e = step * 1e-3
        n = np.stack([f(q + e * d) - f(q - e * d) for d in np.eye(3)], -1)
        n /= np.maximum(np.linalg.norm(n, axis=1), 1e-12)[:, None]
        u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        around = [number(a - u - v), number(a - v), number(a), number(a - u)]
        for c in around:
            np.add.at(matrix, c, n[:, :, None] * n[:, None, :])
            np.add.at(right, c, n * (n * q).sum(1)[:, None])
            np.add.at(middle, c, q)
            np.add.at(hits, c, 1)
        quads.append(np.where(flip[:, None], np.stack(around[::-1], 1), np.stack(around, 1)))
    quads = np.concatenate(quads)
    used, quads = np.unique(quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    mean = middle[used] / hits[used, None]
    value, vector = np.linalg.eigh(matrix[used])
    rest = right[used] - np.einsum("nij,nj->ni", matrix[used], mean)
    inverse = np.where(value > .08 * value[:, 2:], 1 / np.maximum(value, 1e-9), 0)
    move = np.einsum("nij,nj,nkj,nk->ni", vector, inverse, vector, rest)
    place = mean + move * np.minimum(1, step / np.maximum(np.linalg.norm(move, axis=1), 1e-12))[:, None]
    if keep:
        quads = quads[keep(place[quads]).mean(1) < 0]
        rims = np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2)
        names, count = np.unique(np.sort(rims, 1), axis=0, return_counts=True)
        rim = np.unique(names[count == 1])
        for _ in range(4):  # onto the cut
            q, e = place[rim], step * 1e-3
            slope = np.stack([keep(q + e * d) - keep(q - e * d) for d in np.eye(3)], -1) / (2 * e)
            place[rim] -= slope * (keep(q) / np.maximum((slope ** 2).sum(1), 1e-9))[:, None]
    used, quads = np.unique(quads, return_inverse=True)
    return place[used], quads.reshape(-1, 4)


def draw(path, place, ovals):
    """Guides around ovals of the front: middle, radii; three rings on either side."""
    front, angle, made = place[place[:, 2] > .3], np.pi / 8 * np.arange(16), 0
    with open(path, "w") as file:
        for x, y, a, b in ovals:
            for q in np.stack([x + a * np.cos(angle), y + b * np.sin(angle)], -1):
                file.write("v %.6g %.6g %.6g\n" % tuple(front[((front[:, :2] - q) ** 2).sum(1).argmin()]))
            file.write("g rings 3\nl %s\n" % " ".join(str(made + 1 + k % 16) for k in range(17)))
            made += 16


def save(path, place, quads):
    with open(path, "w") as file:
        file.writelines("v %.6g %.6g %.6g\n" % tuple(v) for v in place)
        for q in quads + 1:
            file.write("f %d %d %d\nf %d %d %d\n" % (q[0], q[1], q[2], q[0], q[2], q[3]))


ROWS = [("face", face, (-1, -1.4, -1.2), (1, 1.3, 1.2), .018, None, "--faces 4000 --preset character --symmetry x --guides {loops}"),
        ("creature", creature, (-1.7, -.8, -2.8), (1.7, 1.6, 2.2), .022, None, "--faces 4500 --preset character"),
        ("part", part, (-1.6, -.3, -1.6), (1.6, 1.3, 1.6), .03, None, "--faces 8000 --preset cad"),
        ("garment", garment, (-1.4, -1.5, -1.2), (1.4, 1.2, 1.2), .025, keep_garment, "--faces 3500")]
LOOPS = ((.28, .035, .17, .12), (0, -.545, .24, .11))  # around an eye of the face, and its mouth


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        folder = os.environ.get("KEEP", folder)
        shown, loops = [], f"{folder}/loops.obj"
        for name, f, low, high, step, keep, options in ROWS:
            mesh, quads = f"{folder}/{name}.obj", f"{folder}/{name}-quads.obj"
            place, faces = contour(f, low, high, step, keep)
            save(mesh, place, faces)
            if "{loops}" in options:
                draw(loops, place, LOOPS)
            subprocess.run([program, mesh, "-o", quads, "-q", *options.format(loops=loops).split()], check=True)
            shown += [mesh, quads]
        subprocess.run([program, "render", *shown, "-o", HERE + "/hero.png", "--width", "1800", "--height", "1000"], check=True)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else HERE + "/../../build/quadwright")
