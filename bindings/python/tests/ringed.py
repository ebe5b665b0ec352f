"""An eye, a sleeve and a bolt hole, each with a loop that a person would draw around it; and the rings of quads on both sides of that. Tests in Blender
use it too."""
import numpy as np

AROUND, ALONG = 96, 60  # vertices of a surface


def eye(a, t):
    """A socket around z in a bumpy head."""
    polar = np.pi * t
    x, y, z = np.sin(polar) * np.cos(a), np.sin(polar) * np.sin(a), np.cos(polar)
    r = 1 + 0.04 * np.sin(5 * x) * np.cos(4 * y) * np.cos(3 * z) - 0.35 * np.clip(1 - (polar / 0.5) ** 2, 0, 1) ** 2
    return r * x, 1.2 * r * y, r * z


def sleeve(a, t):
    """A trunk, and an open sleeve that leaves it and bends."""
    polar, out = 2.6 * np.minimum(t / 0.6, 1), np.clip((t - 0.6) / 0.4, 0, 1)
    r, z = np.sin(polar) - 0.1 * out, 1.2 * out - np.cos(polar)
    return r * np.cos(a) + 0.2 * np.clip(z, 0, None) ** 2, (0.7 + 0.3 * out) * r * np.sin(a), z


def hole(a, t):
    """A square plate with a round hole, from the middle of the hole's wall around to it."""
    corner, square = [0, 0.04, 0.46, 0.54, 0.96, 1], 1 / np.maximum(np.abs(np.cos(a)), np.abs(np.sin(a)))
    r = 0.3 + np.interp(t, corner, [0, 0, 1, 1, 0, 0]) * (square - 0.3)
    return r * np.cos(a), r * np.sin(a), np.interp(t, corner, [0, 0.1, 0.1, -0.1, -0.1, 0])


# of each: what t = 0 and t = 1 are, t of the loop, and the range of t in which rings count
PLACES = {"eye": (eye, "points", 7 / 60, (0, 0.25)), "sleeve": (sleeve, "open", 47 / 60, (0.5, 0.99)), "hole": (hole, "joined", 10 / 60, (0.05, 0.4))}


def at(name, t, count):
    """Points that lie around the place."""
    return np.stack(PLACES[name][0](2 * np.pi * np.arange(count) / count, np.full(count, t)), -1)


def make(name):
    """Points and triangles of a surface, and a loop of twelve points on it."""
    place, ends, drawn, _ = PLACES[name]
    a, t = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, np.arange(ALONG + 1) / ALONG)
    points = np.stack(place(a, t), -1).reshape(-1, 3)
    vertex = np.arange(len(points)).reshape(ALONG + 1, AROUND)
    if ends == "joined": vertex[-1] = vertex[0]
    else: vertex[0] = 0
    if ends == "points": vertex[-1] = vertex[-1, 0]
    p, q, r, s = vertex[:-1], np.roll(vertex, -1, 1)[:-1], np.roll(vertex, -1, 1)[1:], vertex[1:]
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ((p, q, r), (p, r, s))])
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3), at(name, drawn, 12)


def rings(name, points, quads):
    """How many loops of edges that go straight on and close wind once around the place, on each side of the drawn loop."""
    place, _, drawn, (least, most) = PLACES[name]
    a, t = (x.ravel() for x in np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, np.arange(4 * ALONG + 1) / (4 * ALONG)))
    surface, at = np.stack(place(a, t), -1), []
    for some in np.array_split(points, 1 + len(points) // 200): at.append(((some[:, None] - surface) ** 2).sum(2).argmin(1))
    a, t = a[np.concatenate(at)], t[np.concatenate(at)]
    ahead = {(q[i], q[(i + 1) % 4]): (q[(i + 1) % 4], q[(i + 2) % 4]) for q in np.asarray(quads).tolist() for i in range(4)}
    degree = np.bincount([v for v, _ in ahead], minlength=len(points))
    seen, sides = set(), [0, 0]
    for start in ahead:
        loop, here = [], start
        while here is not None and here not in seen:
            seen.add(here), loop.append(here[0])
            here = ahead.get(ahead[here][::-1]) if degree[here[1]] == 4 else None
        if here != start or not loop: continue
        turn = (np.diff(a[[*loop, loop[0]]]) + np.pi) % (2 * np.pi) - np.pi
        if abs(turn.sum() - 2 * np.pi) > 1e-6 or t[loop].min() < least or t[loop].max() > most: continue  # each is walked both ways
        if abs(t[loop].mean() - drawn) > 0.5 / ALONG: sides[int(t[loop].mean() > drawn)] += 1
    return sides
