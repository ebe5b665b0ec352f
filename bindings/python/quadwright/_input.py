"""Arrays and meshes of others, as the library wants them. Every check comes before any cast, and names the argument."""
import operator

import numpy as np

_MOST = 2**31 - 1  # indices are 32 bits


class Arrays(tuple):
    """(positions, face_size, sizes or None, corners, marks or None), contiguous and of the library's types."""


def _check_interface(value):
    """NumPy believes an object's __array_interface__, even where the memory that it names is shorter."""
    interface = None if isinstance(value, np.ndarray) else getattr(value, "__array_interface__", None)
    data = interface.get("data") if interface else None
    if data is None or isinstance(data, tuple):
        return
    size = interface.get("offset", 0) + int(np.prod(interface["shape"], dtype=object)) * np.dtype(interface["typestr"]).itemsize
    if interface.get("strides") is not None or memoryview(data).nbytes < size:
        raise ValueError("__array_interface__ tells of more than its data holds")


def _array(value, name):
    try:
        _check_interface(value)
        array = np.asarray(value)
    except Exception as error:  # objects may raise whatever they like while they are asked for their contents
        raise TypeError(f"{name}: cannot be read as an array: {error}") from error
    if array.dtype == object:
        raise TypeError(f"{name}: not an array of numbers (rows of different lengths, or objects)")
    return array


def positions(value, name="vertices"):
    array = _array(value, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: the shape must be (n, 3), not {array.shape}")
    array = np.ascontiguousarray(array, dtype=np.float64)
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"{name}: {array[row, column]} at row {row}, column {column}")
    return array


def _indices(value, name, below):
    array = _array(value, name)
    if array.size == 0 and array.dtype.kind == "f":
        array = array.astype(np.int32)  # [] is an array of floats
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name}: whole numbers are needed, not {array.dtype}")
    if array.size:
        least, most = int(array.min()), int(array.max())
        if least < 0 or most >= below:
            wrong = least if least < 0 else most
            raise IndexError(f"{name}: index {wrong}, but there are {below} vertices")
    return np.ascontiguousarray(array, dtype=np.int32)


def _faces(value, name, below, sizes):
    if sizes is not None:
        sizes = _array(sizes, "face_sizes")
        if sizes.dtype.kind not in "iu" or sizes.ndim != 1:
            raise TypeError("face_sizes: a list of whole numbers is needed, one a face")
        if sizes.size and (int(sizes.min()) < 3 or int(sizes.max()) > _MOST):
            raise ValueError("face_sizes: a face has three corners or more")
        corners = _indices(value, name, below)
        if corners.ndim != 1:
            raise ValueError(f"{name}: with face_sizes the shape must be (corners,), not {corners.shape}")
        if int(sizes.sum(dtype=np.int64)) != corners.size:
            raise ValueError(f"face_sizes: the sizes sum to {int(sizes.sum(dtype=np.int64))}, but {name} has {corners.size} corners")
        return 0, np.ascontiguousarray(sizes, dtype=np.int32), corners
    corners = _indices(value, name, below)
    if corners.ndim != 2 or corners.shape[1] not in (3, 4):
        raise ValueError(f"{name}: the shape must be (n, 3) or (n, 4), or (corners,) with face_sizes, not {corners.shape}")
    return corners.shape[1], None, corners


def arrays(vertices, faces, face_sizes=None, marked_edges=None, names=("vertices", "faces")):
    points = positions(vertices, names[0])
    if len(points) > _MOST:
        raise ValueError(f"{names[0]}: more than {_MOST} of them")
    size, sizes, corners = _faces(faces, names[1], len(points), face_sizes)
    marks = None
    if marked_edges is not None:
        marks = _indices(marked_edges, "marked_edges", len(points))
        if marks.size and (marks.ndim != 2 or marks.shape[1] != 2):
            raise ValueError(f"marked_edges: the shape must be (n, 2), not {marks.shape}")
        marks = marks if marks.size else None
    return Arrays((points, size, sizes, corners, marks))


_MESHIO_SIZES = {"triangle": 3, "quad": 4}


def _of_meshio(mesh, names):
    sizes, corners = [], []
    for block in mesh.cells:
        data = np.asarray(block.data)
        if block.type in _MESHIO_SIZES or block.type.startswith("polygon"):
            sizes.append(np.full(len(data), data.shape[1] if data.ndim == 2 else 0))
            corners.append(data.reshape(-1))
    if not corners:
        raise ValueError(f"{names[1]}: the meshio mesh has no triangles, quads or polygons")
    points = np.asarray(mesh.points)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    all_sizes = np.concatenate(sizes)
    if all_sizes.size and (all_sizes == all_sizes[0]).all() and all_sizes[0] in (3, 4):
        return arrays(points, np.concatenate(corners).reshape(-1, int(all_sizes[0])), names=names)
    return arrays(points, np.concatenate(corners), all_sizes, names=names)


def take(mesh, faces=None, face_sizes=None, marked_edges=None, name=None):
    """Arrays of (vertices, faces), of a Mesh or a Result, or of a mesh of trimesh or meshio."""
    names = ("vertices", "faces") if name is None else (f"{name}: vertices", f"{name}: faces")
    if faces is not None:
        return arrays(mesh, faces, face_sizes, marked_edges, names)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return arrays(*mesh, face_sizes, marked_edges, names)
    if hasattr(mesh, "points") and hasattr(mesh, "cells"):
        return _of_meshio(mesh, names)
    if hasattr(mesh, "vertices") and hasattr(mesh, "quads"):
        return arrays(mesh.vertices, mesh.quads, None, marked_edges, names)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        marks = getattr(mesh, "marked_edges", None) if marked_edges is None else marked_edges
        return arrays(mesh.vertices, mesh.faces, getattr(mesh, "face_sizes", None), marks, names)
    raise TypeError(f"{names[1]}: missing; give vertices and faces, or a mesh that has both")


def option_text(name, kind, value):
    """An option's value as text; TypeError where its kind is another."""
    if kind == "flag":
        if isinstance(value, (bool, np.bool_)):
            return "on" if value else "off"
    elif kind == "choice":
        if isinstance(value, str):
            return value
    elif not isinstance(value, (bool, np.bool_, str, bytes)):
        try:
            return str(operator.index(value)) if kind == "count" else repr(float(value))
        except (TypeError, ValueError):
            pass
    wanted = {"flag": "True or False", "choice": "a str", "count": "a whole number", "real": "a number"}[kind]
    raise TypeError(f"{name}: must be {wanted}, not {value!r:.60}")
