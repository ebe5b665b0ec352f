#!/usr/bin/python3
"""Joints bent by 90 degrees. usage: out/python-venv/bin/python bench/poses.py PLACES.tsv INPUT.obj FACES [PERSON.obj]
PLACES: name, centre x y z, axis x y z, radius, a line each; each line of a limb (not eye, mouth, ear) is a joint, beyond which the axis points or
its opposite, whichever side is the smaller. INPUT gets smooth weights of these joints and is remeshed with --follow-motion 0 and by default. Each
result is bent by the weights that it carries, each joint alone; printed is the area, in thousandths of that around the joint, of quads that are
inverted (their normal is turned against that of the surface, rotated by the same weights) or folded (a corner is turned against the others),
beside the same of a person's mesh of the surface, which takes the weights of the nearest points."""
import sys
import numpy as np
import quadwright
from scipy.spatial import cKDTree


def read_obj(path):
    points, faces = [], []
    for line in open(path):
        words = line.split()
        if words[:1] == ["v"]: points.append([float(x) for x in words[1:4]])
        if words[:1] == ["f"]: faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    return np.array(points), np.array([f + f[-1:] * (4 - len(f)) for f in faces])


def side_beyond(points, neighbours, joint):
    """Vertices that a walk from beyond the joint reaches without crossing its plane near it."""
    centre, axis, radius = joint
    along, is_near = (points - centre) @ axis, np.linalg.norm(points - centre, axis=1) < 2 * radius
    first = np.argmin(np.linalg.norm(points - centre - 0.4 * radius * axis, axis=1) + np.where(along > 0, 0, 1e9))
    inside, stack = np.zeros(len(points), bool), [first]
    inside[first] = True
    while stack:
        v = stack.pop()
        for w in neighbours[v]:
            if not inside[w] and not (is_near[v] and is_near[w] and (along[v] > 0) != (along[w] > 0)): inside[w] = True; stack.append(w)
    return inside


def make_rig(points, faces, table):
    """Joints, each with its outward axis; how much each moves every vertex; and which lie beyond which."""
    neighbours = [set() for _ in points]
    for f in faces:
        for k in range(4): neighbours[f[k]].add(f[k - 1]); neighbours[f[k - 1]].add(f[k])
    joints, moved = [], []
    for name, centre, axis, radius in table:
        axis = axis / np.linalg.norm(axis)
        side = [side_beyond(points, neighbours, (centre, s * axis, radius)) for s in (1, -1)]
        s = 0 if side[0].sum() <= side[1].sum() else 1
        axis = axis if s == 0 else -axis
        along = (points - centre) @ axis
        section = (np.abs(along) < 0.5 * radius) & (np.linalg.norm(points - centre, axis=1) < 2 * radius)
        girth = np.median(np.linalg.norm((points - centre)[section] - along[section, None] * axis, axis=1))
        near = np.linalg.norm(points - centre, axis=1) < 2 * radius
        t = np.clip(0.5 + along / (2 * girth), 0, 1)
        joints.append((name, centre, axis, radius))
        moved.append(np.where(near & (np.abs(along) < girth), t * t * (3 - 2 * t), side[s].astype(float)))
    beyond = [[k for k in range(len(joints)) if k != j and (moved[k] > 0.99).sum() < (moved[j] > 0.99).sum()
               and moved[j][moved[k] > 0.99].mean() > 0.5] for j in range(len(joints))]
    return joints, np.array(moved), beyond


def weights_of(moved, beyond):
    """Four groups a vertex: joint j with number j + 1, the rest 0."""
    every = np.array([np.ones(moved.shape[1])] + [m for m in moved])
    for j, of in enumerate(beyond):
        for k in of: every[j + 1] *= 1 - moved[k]
    for m in moved: every[0] *= 1 - m
    order = np.argsort(-every, axis=0, kind="stable")[:4].T
    weight = np.take_along_axis(every.T, order, 1)
    return (weight / weight.sum(1, keepdims=True)).astype(np.float32), order.astype(np.uint32)


def rotation(axis, angle):
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def corner_normals(points, quads):
    p = points[quads]
    return np.cross(np.roll(p, -1, 1) - p, np.roll(p, 1, 1) - p)


def bad_area(points, quads, share, joint):
    """The area of inverted or folded quads over that of all that the bend touches or that lies near it, in thousandths."""
    name, centre, axis, radius = joint
    towards = np.array([0, 0, 1.0]) if "elbow" in name else np.array([0, 0, -1.0]) if "knee" in name else np.array([-np.sign(centre[0]), 0, 0])
    turn = rotation(np.cross(axis, towards), np.pi / 2)
    bent = points + share[:, None] * ((points - centre) @ turn.T + centre - points)
    before, after = corner_normals(points, quads), corner_normals(bent, quads)
    mean = after.sum(1)
    part = share[quads].mean(1)[:, None]
    turned = (1 - part) * before.sum(1) + part * (before.sum(1) @ turn.T)
    bad = ((after * mean[:, None]).sum(2) <= 0).any(1) | ((mean * turned).sum(1) <= 0)
    already = ((before * before.sum(1)[:, None]).sum(2) <= 0).any(1)
    area = np.linalg.norm(before.sum(1), axis=1) / 4
    near = np.linalg.norm(points[quads].mean(1) - centre, axis=1) < 1.5 * radius
    return 1000 * area[bad & ~already].sum() / area[near].sum()


def main():
    places, source, count = sys.argv[1:4]
    rows = [l.split() for l in open(places) if l.strip() and not l.startswith("#")]
    table = [(r[0], np.array(r[1:4], float), np.array(r[4:7], float), float(r[7])) for r in rows if r[0].split("-")[0] not in ("eye", "mouth", "ear")]
    points, faces = read_obj(source)
    joints, moved, beyond = make_rig(points, faces, table)
    weight, group = weights_of(moved, beyond)
    meshes = []
    for follow in (0, 0.5):
        skin = quadwright.Attribute(weight, "vertex", "weights", groups=group)
        made = quadwright.remesh(points, faces, faces=int(count), follow_motion=follow, attributes={"skin": skin})
        meshes.append((f"follow-motion {follow}", made.vertices, made.quads, made.attributes["skin"].values, made.attributes["skin"].groups))
        made.save(f"{sys.argv[5]}-{follow}.obj") if len(sys.argv) > 5 else None
    for path in sys.argv[4:5]:
        theirs, quads = read_obj(path)
        nearest = cKDTree(points).query(theirs)[1]
        meshes.append(("person", theirs, quads, weight[nearest], group[nearest]))
    for name, at, quads, values, groups in meshes:
        found = {}
        for j, joint in enumerate(joints):
            kind = joint[0].split("-")[0].rstrip("12345")
            if kind not in ("elbow", "knee", "finger"): continue
            share = sum(np.where(groups == k + 1, values, 0).sum(1) for k in [j] + beyond[j])
            found.setdefault(kind, []).append(bad_area(at, quads, share, joint))
        print(f"{name}, {len(quads)} quads: " + ", ".join(f"{kind} {np.mean(v):.1f}" for kind, v in found.items()))


if __name__ == "__main__":
    main()
