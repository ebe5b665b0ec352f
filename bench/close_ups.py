#!/usr/bin/python3
"""Close-ups of quads that a person made, and of ours of as many on the same surface, in one picture.

usage: close_ups.py QUADWRIGHT PICTURE.png SURFACE RADIUS 'X Y Z' PERSON.obj...
For each person's mesh, four at most: what lies within RADIUS of the place X Y Z, the person's, then ours, made of SURFACE with default options."""
import os
import subprocess
import sys
import tempfile


def read(path):
    rows = [line.split() for line in open(path)]
    return [tuple(map(float, r[1:4])) for r in rows if r and r[0] == "v"], [[int(x.split("/")[0]) - 1 for x in r[1:]] for r in rows if r and r[0] == "f"]


def close_up(source, result, place, radius):
    """The faces of which all corners lie in the ball; how many."""
    points, faces = read(source)
    inside = [sum((a - b) ** 2 for a, b in zip(p, place)) < radius * radius for p in points]
    kept = [f for f in faces if all(inside[v] for v in f)]
    index = {v: i + 1 for i, v in enumerate(sorted({v for f in kept for v in f}))}
    with open(result, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % points[v] for v in index)
        out.writelines("f " + " ".join(str(index[v]) for v in f) + "\n" for f in kept)
    return len(kept)


def main():
    program, picture, surface, radius, place, *people = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        shown = []
        for person in people:
            name, count = os.path.splitext(os.path.basename(person))[0], len(read(person)[1])
            ours = os.path.join(folder, name + "-ours.obj")
            subprocess.run([program, surface, "-o", ours, "--faces", str(count), "-q"], check=True)
            for mesh, label in ((person, "by hand"), (ours, "ours")):
                shown.append(os.path.join(folder, f"{label}, {count}.obj"))
                if close_up(mesh, shown[-1], tuple(map(float, place.split())), float(radius)) == 0: sys.exit(f"nothing of {mesh} lies at {place}")
        subprocess.run([program, "render", *shown, "-o", picture, "--width", "1500", "--height", "1000", "--azimuth", "15", "--elevation", "8"], check=True)


main()
