#!/usr/bin/python3
"""Lines of two programs, or of one with other options, side by side: the share of the area in strips that never cross themselves,
and what is paid for it.

usage: lines.py 'OLD PROGRAM OPTIONS' 'NEW PROGRAM OPTIONS' MESH...
Each is run as `PROGRAM MESH -o RESULT OPTIONS`; the new program measures both. Prints a row a mesh, then medians."""
import json
import statistics
import subprocess
import sys
import tempfile

KEYS = ["irregular", "angle_rms", "chamfer", "hausdorff_p999", "patches"]


def numbers(tree):
    """All numbers of nested objects, by their names."""
    found = {}
    for name, value in tree.items():
        found.update(numbers(value) if isinstance(value, dict) else {name: value} if isinstance(value, (int, float)) else {})
    return found


def figures(command, judge, mesh):
    program, *options = command.split()
    with tempfile.TemporaryDirectory() as folder:
        result = folder + "/result.obj"
        subprocess.run([program, mesh, "-o", result, "-q", *options], check=True, capture_output=True)
        said = subprocess.run([judge, "measure", result, "--against", mesh, "--json"], check=True, capture_output=True, text=True)
    return numbers(json.loads(said.stdout))


def main():
    old, new, meshes = sys.argv[1], sys.argv[2], sys.argv[3:]
    rows = [[figures(command, new.split()[0], mesh) for command in (old, new)] for mesh in meshes]
    for mesh, (a, b) in zip(meshes, rows):
        print(f"{mesh}: simple {a['simple']:.2f} {b['simple']:.2f}, flipped {a['flipped_faces']} {b['flipped_faces']}")
    for middle in (statistics.median, statistics.mean):
        print(f"simple, {middle.__name__}: {middle(a['simple'] for a, b in rows):.3f} {middle(b['simple'] for a, b in rows):.3f}")
    for key in KEYS:
        print(f"{key}, median of the ratios: {statistics.median(b[key] / a[key] for a, b in rows if a[key] > 0):.3f}")


if __name__ == "__main__":
    main()
