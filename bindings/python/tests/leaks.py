"""leaks.py COUNT: that many remeshes, one after another, with everything that goes in and comes out, failures and cancelled runs too; resident memory must
stay flat after the first tenth. Run under AddressSanitizer by tools/python-package asan."""
import gc
import sys

import numpy as np
import quadwright
from conftest import torus


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def one(points, faces, i):
    if i % 10 == 3:
        try:
            quadwright.remesh(points, faces, faces=60, threads=1, progress=lambda stage, fraction: quadwright.CANCEL if fraction >= 0.4 else None)
        except quadwright.Cancelled:
            return
    if i % 10 == 6:
        try:
            quadwright.remesh(points, faces, faces=60, guides=[np.zeros((2, 3))], threads=1)
        except quadwright.ArgumentError:
            return
    labels = quadwright.Attribute(np.arange(len(faces)) % 3, "face", names=["a", "b", "c"])
    result = quadwright.remesh(points, faces, faces=60, threads=1, attributes={"material": labels, "heat": points[:, 0], "uv": points[faces][:, :, :2]},
                               keep="heat" if i % 10 == 9 else None, density=1 + points[:, 2] ** 2, provenance=True, field_per="vertex")
    if i % 10 == 0:
        result.save("leaks.obj")
        quadwright.load("leaks.obj")
        result.measure(against=(points, faces))
        quadwright.render(result, "leaks.png", width=64, height=64)


def main(count):
    points, faces = torus(16, 8)
    for i in range(count // 10):
        one(points, faces, i)
    gc.collect()
    before = resident()
    for i in range(count - count // 10):
        one(points, faces, i)
    gc.collect()
    grown = resident() - before
    print(f"{count} remeshes: resident memory {before >> 20} MiB after a tenth of them, {grown / 2**20:+.1f} MiB after the rest")
    if "--loose" not in sys.argv and grown > 4 << 20:
        sys.exit("it grew")


main(int(sys.argv[1]))
