"""without_numpy.py EXTENSION OUT: remeshes a sheet by the extension alone, for a Python that has no NumPy, and writes its quads."""
import importlib.machinery
import importlib.util
import os
import sys

SIDE = 24


def numbers(kind, size, values):
    """A buffer of numbers; the module array may not be there."""
    buffer = memoryview(bytearray(size * len(values))).cast(kind)
    for i, value in enumerate(values):
        buffer[i] = value
    return buffer


def sheet():
    """A mesh as the extension takes it: positions, corners of a face, sizes, corners, marks."""
    positions = [c for i in range(SIDE) for j in range(SIDE) for c in (i, j, (i * i - j * j) / (4 * SIDE))]
    corners = []
    for a in (i * SIDE + j for i in range(SIDE - 1) for j in range(SIDE - 1)):
        corners += [a, a + SIDE, a + SIDE + 1, a, a + SIDE + 1, a + 1]
    return numbers("d", 8, positions), 3, None, numbers("I", 4, corners), None


def main(extension, out):
    loader = importlib.machinery.ExtensionFileLoader("quadwright._native", extension)
    native = importlib.util.module_from_spec(importlib.util.spec_from_loader("quadwright._native", loader))
    stages = []
    context = native.Context(0)
    context.set_mesh(sheet())
    told = context.run([("faces", "150")], lambda stage, fraction: stages.append(stage), None, False, 0, -1, 0, None)
    mesh = told[0]
    native.save(mesh, [], None, None, out, 0)
    assert os.path.getsize(out) > 2000 and stages, "no quads were written"
    try:
        context.run([("faces", "-1")], None, None, False, 0, -1, 0, None)
    except RuntimeError:
        print(native.version, "on", sys.version.split()[0], len(memoryview(mesh[3]).cast("B")) // 16, "quads")
    else:
        sys.exit("a count below 0 was taken")


main(*sys.argv[1:])
