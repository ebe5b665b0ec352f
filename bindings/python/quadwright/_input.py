"""Arrays and meshes of others, as the library wants them. Every check comes before any cast, and names the argument."""
import logging
import operator
import os

import numpy as np

from . import _others

_logger = logging.getLogger("quadwright")
_MOST = 2**31 - 1  # indices are 32 bits


class Arrays(tuple):
    """(positions, face_size, sizes or None, corners, marks or None), contiguous and of the library's types. own: the attributes that the object
    brings along, as {name: Attribute or array}; library: the mtllib of an OBJ file that it comes from, or None; scene: what else its file holds, or None."""

    own: dict = {}
    library = None
    scene = None
    of_points = False  # the faces join points that came without any


def _with_own(arrays_, mesh):
    arrays_.own = getattr(mesh, "attributes", None) or {}
    arrays_.library = getattr(mesh, "library", None)
    arrays_.scene = getattr(mesh, "scene", None)
    return arrays_


def _check_interface(value):
    """NumPy believes an object's __array_interface__, even where the memory that it names is shorter."""
    interface = None if isinstance(value, np.ndarray) else getattr(value, "__array_interface__", None)
    data = interface.get("data") if interface else None
    if data is None or isinstance(data, tuple):
        return
    size = interface.get("offset", 0) + int(np.prod(interface["shape"], dtype=object)) * np.dtype(interface["typestr"]).itemsize
    if interface.get("strides") is not None or memoryview(data).nbytes < size:
        raise ValueError("__array_interface__ tells of more than its data holds")


def array(value, name):
    try:
        _check_interface(value)
        taken = np.asarray(value)
    except Exception as error:  # objects may raise whatever they like while they are asked for their contents
        raise TypeError(f"{name}: cannot be read as an array: {error}") from error
    if taken.dtype == object:
        raise TypeError(f"{name}: not an array of numbers (rows of different lengths, or objects)")
    return taken


def positions(value, name="vertices"):
    points = array(value, name)
    if points.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {points.dtype}")
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{name}: the shape must be (n, 3), not {points.shape}")
    points = np.ascontiguousarray(points, dtype=np.float64)
    if not np.isfinite(points).all():
        row, column = np.argwhere(~np.isfinite(points))[0]
        raise ValueError(f"{name}: {points[row, column]} at row {row}, column {column}")
    return points


def _indices(value, name, below):
    indices = array(value, name)
    if indices.size == 0 and indices.dtype.kind == "f":
        indices = indices.astype(np.int32)  # [] is an array of floats
    if indices.dtype.kind not in "iu":
        raise TypeError(f"{name}: whole numbers are needed, not {indices.dtype}")
    if indices.size:
        least, most = int(indices.min()), int(indices.max())
        if least < 0 or most >= below:
            wrong = least if least < 0 else most
            raise IndexError(f"{name}: index {wrong}, but there are {below} vertices")
    return np.ascontiguousarray(indices, dtype=np.int32)


def _faces(value, name, below, sizes):
    if sizes is not None:
        sizes = array(sizes, "face_sizes")
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
        hint = _padding(corners)
        raise ValueError(f"{name}: the shape must be (n, 3) or (n, 4), or (corners,) with face_sizes, not {corners.shape}{hint}")
    if corners.shape[1] == 4 and len(corners) and (corners[:, 0] == 3).all() and (corners[:, 1:] == 3).any():
        raise ValueError(f"{name}: every row begins with 3, the size of a face{_padding(corners)}")
    return corners.shape[1], None, corners


def _padding(corners):
    """What to give of faces that have their sizes before their corners, as those of PyVista and VTK do; or nothing."""
    size = int(corners.flat[0]) if corners.size else 0
    if size not in (3, 4) or corners.size % (size + 1) or (corners.reshape(-1, size + 1)[:, 0] != size).any():
        return ""
    return f"; sizes stand before the corners, as PyVista has them: give faces.reshape(-1, {size + 1})[:, 1:], or the mesh itself"


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
    sizes, corners, used = [], [], []
    for number, block in enumerate(mesh.cells):
        data = np.asarray(block.data)
        if block.type in _MESHIO_SIZES or block.type.startswith("polygon"):
            sizes.append(np.full(len(data), data.shape[1] if data.ndim == 2 else 0))
            corners.append(data.reshape(-1))
            used.append(number)
    if not corners:
        raise ValueError(f"{names[1]}: the meshio mesh has no triangles, quads or polygons")
    points = np.asarray(mesh.points)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    all_sizes = np.concatenate(sizes)
    if all_sizes.size and (all_sizes == all_sizes[0]).all() and all_sizes[0] in (3, 4):
        taken = arrays(points, np.concatenate(corners).reshape(-1, int(all_sizes[0])), names=names)
    else:
        taken = arrays(points, np.concatenate(corners), all_sizes, names=names)
    of_cells = {name: np.concatenate([np.asarray(blocks[i]) for i in used]) for name, blocks in getattr(mesh, "cell_data", {}).items()}
    from ._attributes import Attribute

    taken.own = {name: Attribute(value, "vertex") for name, value in _numeric(getattr(mesh, "point_data", {})).items()}
    taken.own.update({name: Attribute(value, "face") for name, value in _numeric(of_cells).items() if name not in taken.own})
    return taken


def _of_vtk(mesh, names):
    from ._attributes import Attribute

    points, corners, sizes, of_points, of_cells = _others.of_vtk(mesh)
    if len(sizes) and sizes[0] in (3, 4) and (sizes == sizes[0]).all():
        taken = arrays(points, corners.reshape(-1, int(sizes[0])), names=names)
    else:
        taken = arrays(points, corners, sizes, names=names)
    taken.own = {name: Attribute(value, "vertex") for name, value in _numeric(of_points).items()}
    taken.own.update({name: Attribute(value, "face") for name, value in _numeric(of_cells).items() if name not in taken.own})
    return taken


def _numeric(found):
    """Those that the library can carry."""
    kept = {}
    for name, value in found.items():
        try:
            value = np.asarray(value)
        except Exception as error:
            _logger.warning("%s is left behind: %s", name, error)
            continue
        columns = 1 if value.ndim == 1 else value.shape[1] if value.ndim == 2 else 0
        if value.dtype.kind in "fiu" and 1 <= columns <= 16 and np.isfinite(value).all():
            kept[str(name)] = value
        else:
            _logger.warning("%s is left behind: %s %s", name, value.dtype, value.shape)
    return kept


def _of_trimesh(mesh, vertices, faces):
    """Texture coordinates, colours and attributes of a trimesh.Trimesh."""
    visual, found = mesh.visual, {}
    uv = getattr(visual, "uv", None)
    if uv is not None and len(uv) == vertices:
        found["uv"] = uv
    if getattr(visual, "kind", None) == "vertex":
        found["color"] = visual.vertex_colors
    if getattr(visual, "kind", None) == "face":
        found["color"] = visual.face_colors
    own = _numeric({**found, **getattr(mesh, "vertex_attributes", {}), **getattr(mesh, "face_attributes", {})})
    return {name: value for name, value in own.items() if (len(value) == vertices) != (len(value) == faces)}


def _hint(mesh):
    """What to do with an object that has the vertices and faces of a mesh by other names, or names a file; or None."""

    def has(*names):
        return all(hasattr(mesh, name) for name in names)

    if isinstance(mesh, (str, bytes, os.PathLike)):
        return f"the name of a file, {mesh!r:.80}; quadwright.load() reads it: remesh(load(name))"
    if has("vert_properties", "tri_verts"):
        return "a mesh of manifold3d; give mesh.vert_properties[:, :3] and mesh.tri_verts"
    if has("to_mesh", "status"):
        return "a Manifold; with mesh = manifold.to_mesh() give mesh.vert_properties[:, :3] and mesh.tri_verts"
    if has("vertices", "triangles"):
        return "a mesh as of Open3D; give np.asarray(mesh.vertices) and np.asarray(mesh.triangles)"
    if has("vertex", "triangle"):
        return "a mesh as of Open3D; give mesh.vertex.positions.numpy() and mesh.triangle.indices.numpy()"
    if has("points", "extract_surface"):
        given = "mesh.points and mesh.regular_faces"
        return f"a mesh as of PyVista; with mesh = mesh{'' if has('faces') else '.extract_surface()'}.triangulate() give {given}"
    if has("vertices", "polygons"):
        return "a mesh as of Blender; the add-on remeshes it (docs/blender.md), or give arrays of its vertices and loop triangles"
    return None


def _points_of(mesh):
    """(points, {name: array of points}) of what has no faces: an array, a PointCloud of Open3D, VTK's or PyVista's points; or None."""
    if isinstance(mesh, (np.ndarray, list)):
        return mesh, {}
    if _others.is_vtk(mesh):
        return _others.points_of_vtk(mesh)
    if type(mesh).__module__.startswith("open3d") and (hasattr(mesh, "points") or hasattr(mesh, "point")):
        return _others.points_of_open3d(mesh)
    faces = next((getattr(mesh, name) for name in ("faces", "quads", "triangles", "cells") if hasattr(mesh, name)), ())
    if not hasattr(faces, "__len__") or len(faces) or _hint(mesh):
        return None
    found = getattr(mesh, "vertices", None) if hasattr(mesh, "vertices") else getattr(mesh, "points", None)
    return None if found is None or callable(found) else (found, {})


def take_points(mesh, triangles):
    """Points without faces, as arrays with the triangles that the function gives for them; or None, where it is none of those."""
    found = _points_of(mesh)
    if found is None:
        return None
    places = positions(found[0])
    if len(places) > _MOST:
        raise ValueError(f"vertices: more than {_MOST} of them")
    none = np.zeros(0, np.int32)
    corners = np.asarray(triangles(Arrays((places, 3, None, none, None)))).reshape(-1, 3)
    taken = Arrays((places, 3, None, np.ascontiguousarray(corners, dtype=np.int32), None))
    from ._attributes import Attribute

    taken.own = {name: Attribute(values, "vertex") for name, values in _numeric(found[1]).items()} or (getattr(mesh, "attributes", None) or {})
    taken.of_points = True
    return taken


def take(mesh, faces=None, face_sizes=None, marked_edges=None, name=None):
    """Arrays of (vertices, faces), of a Mesh or a Result, or of a mesh of trimesh, meshio, VTK, PyVista or Open3D."""
    names = ("vertices", "faces") if name is None else (f"{name}: vertices", f"{name}: faces")
    if faces is not None:
        return arrays(mesh, faces, face_sizes, marked_edges, names)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return arrays(*mesh, face_sizes, marked_edges, names)
    if _others.is_vtk(mesh):
        return _of_vtk(mesh, names)
    if _others.is_open3d(mesh):
        from ._attributes import Attribute

        points, triangles, own = _others.of_open3d(mesh)
        taken = arrays(points, triangles, None, marked_edges, names)
        taken.own = {name: Attribute(values, per) for name, (values, per) in own.items()}
        return taken
    if hasattr(mesh, "points") and isinstance(getattr(mesh, "cells", None), list):
        return _of_meshio(mesh, names)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        marks = getattr(mesh, "marked_edges", None) if marked_edges is None else marked_edges
        taken = arrays(mesh.vertices, mesh.faces, getattr(mesh, "face_sizes", None), marks, names)
        if hasattr(mesh, "visual"):  # trimesh
            taken.own = _of_trimesh(mesh, len(taken[0]), len(taken[3]))
            return taken
        return _with_own(taken, mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "quads"):
        return _with_own(arrays(mesh.vertices, mesh.quads, None, marked_edges, names), mesh)
    hint = _hint(mesh)
    if hint:
        raise TypeError(f"{names[0]}: {hint}")
    raise TypeError(f"{names[1]}: missing; give vertices and faces, or a mesh that has both")


def option_text(name, kind, value):
    """An option's value as text; TypeError where its kind is another."""
    if kind == "flag":
        if isinstance(value, (bool, np.bool_)):
            return "on" if value else "off"
    elif kind == "choice":
        if isinstance(value, str):
            if not value.isprintable():
                raise ValueError(f"{name}: {value!r:.60} is none of its choices")
            return value
    elif not isinstance(value, (bool, np.bool_, str, bytes)):
        try:
            whole = int(value) if isinstance(value, float) and value.is_integer() else value
            return str(operator.index(whole)) if kind == "count" else repr(float(value))
        except (TypeError, ValueError):
            pass
    wanted = {"flag": "True or False", "choice": "a str", "count": "a whole number", "real": "a number"}[kind]
    raise TypeError(f"{name}: must be {wanted}, not {value!r:.60}")
