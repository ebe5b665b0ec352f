"""Arguments at random, most of them wrong: an exception that begins with the argument's name or a class of the package's, or a result, and nothing else."""
import random

import numpy as np
import quadwright
from conftest import torus
from quadwright import Attribute, Guide

ARGUMENTS = ("vertices", "faces", "face_sizes", "marked_edges", "attributes", "keep", "density", "guides", "field", "per", "kind", "storage", "symmetry",
             "most_weights", "field_per")


class Moody:
    """An array that is another each time it is asked."""

    def __init__(self, pick):
        self.pick = pick

    def __array__(self, *_, **__):
        return np.asarray(self.pick())


def some_array(pick, rows):
    shape = pick([(rows,), (rows, 1), (rows, 2), (rows, 3), (rows, 4), (0,), (rows + 1, 3), (2, rows, 3), (1,) * 5, ()])
    kind = pick(["f8", "f4", "i4", "i8", "u1", "u8", "bool", "c16", "S3", "O", ">f8", ">i4", "f2", "M8[s]"])
    scale = pick([1, 1, 1, 3, 100, 1e300])
    with np.errstate(all="ignore"):
        values = np.arange(np.prod(shape, dtype=int)).reshape(shape) % 7 / 7 * scale
        if kind == "M8[s]":
            return values.astype("i8").astype(kind)
        array = np.array(values.astype(kind), kind)
    if array.dtype.kind == "f" and array.size and pick([True, False, False]):
        array.reshape(-1)[0] = pick([np.nan, np.inf, -1, 0])
    return pick([array, array, array, np.asfortranarray(array), np.flip(array), array.tolist(), Moody(lambda: pick([array, values]))])


def some_value(pick, rows):
    return pick([None, 3, -1, "seams", "it", b"it", [], {}, (), object(), 1e300, float("nan"), range(3), np.float64(2), "\0", "\udcff", [None], lambda: 0,
                 some_array(pick, rows), some_array(pick, rows)])


def some_arguments(pick, points, faces):
    given = {}
    counts = [len(points), len(faces), faces.size, 5]
    for name in ("attributes", "density", "guides", "field", "marked_edges", "keep", "face_sizes", "symmetry", "most_weights", "field_per"):
        if pick(range(12)) == 0:
            given[name] = some_value(pick, pick(counts))
    if pick(range(3)) == 0:
        rows = pick(counts)
        given["attributes"] = {pick(["it", "uv", "normal", "color", "", "a\n", 3]): pick([
            some_array(pick, rows), Attribute(some_value(pick, rows), pick(["vertex", "corner", "face", None]), pick(["values", "normals", "uvs", "weights", "labels", None]),
                                              groups=some_value(pick, rows), names=pick([None, ["a"], ["a"] * 50, "abc", [3], ["\n"]]), storage=pick([None, "uint8", "int8"]))])}
    if pick(range(6)) == 0:
        given["guides"] = [pick([some_array(pick, 4), Guide(some_value(pick, 4), pick(["loop", "direction"]), pick([True, False])), points[:4], points[[0, 20]]])
                           for _ in range(pick([0, 1, 2]))]
    return given


def test_at_random():
    points, faces = torus(12, 8)
    made = random.Random(20)
    done = {"result": 0, "refused": 0}
    for case in range(400):
        given = some_arguments(made.choice, points, faces)
        where = made.choice([(points, faces)] * 6 + [(some_value(made.choice, len(points)), faces), (points, some_value(made.choice, len(faces)))])
        try:
            result = quadwright.remesh(*where, faces=40, threads=1, **given)
            assert np.isfinite(result.vertices).all() and result.quads.min() >= 0 and result.quads.max() < len(result.vertices), case
            done["result"] += 1
        except quadwright.Error:
            done["refused"] += 1
        except (TypeError, ValueError, IndexError) as error:
            assert str(error).startswith(ARGUMENTS), (case, error)
            done["refused"] += 1
    assert done["result"] > 60 and done["refused"] > 150, done
