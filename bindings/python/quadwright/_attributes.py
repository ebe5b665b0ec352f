"""Attributes, guides, crosses and densities: what goes with a surface, as the library wants it. Checks name the argument."""
import numbers
import os

import numpy as np

from . import _input

DOMAINS = ("vertex", "corner", "face")  # qw_domain
KINDS = ("values", "normals", "uvs", "weights", "labels")  # qw_attribute_kind
_STORAGES = ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32")  # qw_storage
_RULES = {"values": (1, 16, DOMAINS), "normals": (3, 3, DOMAINS[:2]), "uvs": (2, 3, DOMAINS[:2]), "weights": (1, 16, DOMAINS[:1]),
          "labels": (1, 1, DOMAINS)}
_WELL_KNOWN = {"uv": "uvs", "normal": "normals"}  # as files have them


class Attribute:
    """Numbers of vertices, corners or faces.

    values: float32 (n, k), k from 1 to 16, or (n,); labels: int32 (n,). n goes by `per`: "vertex", "corner" (those of face 0, then of face 1, ...; (m,
    3, k) is taken too) or "face". kind: what becomes of them.

    "values"   interpolated: colours, shape keys, anything
    "normals"  (n, 3), of vertices or corners: interpolated, of unit length
    "uvs"      (n, 2) or (n, 3), of vertices or corners: interpolated within their chart; results have them per corner
    "weights"  (n, k) of vertices, with groups (n, k), whole numbers: blended, the largest kept, 1 together. names: of groups 0, 1, ...; or None
    "labels"   whole numbers: never mixed. names: what labels 0, 1, ... are called, each label is one of them or -1 then; or None

    What is None is found out: per by the number of rows, kind "labels" for whole numbers in one column, "uvs" and "normals" by the names "uv" and
    "normal" of files, else "values". Colours ("color") are 0 to 1; those of uint8, 0 to 255, are divided by 255. storage: the type that a PLY file
    holds them in ("uint8", "float32", ...). name: what files call it, where that is not its key.
    """

    __slots__ = ("values", "per", "kind", "groups", "names", "storage", "name")

    def __init__(self, values, per=None, kind=None, *, groups=None, names=None, storage=None, name=None):
        for word, value, known in (("per", per, DOMAINS), ("kind", kind, KINDS), ("storage", storage, _STORAGES)):
            if value is not None and not (isinstance(value, str) and value in known):
                raise ValueError(f"{word}: must be {', '.join(known)}, not {value!r:.40}")
        self.values, self.per, self.kind, self.groups, self.names, self.storage, self.name = values, per, kind, groups, names, storage, name

    def __array__(self, dtype=None, copy=None):
        return np.array(self.values, dtype=dtype) if copy else np.asarray(self.values, dtype=dtype)

    def __len__(self):
        return len(self.values)

    def __repr__(self):
        return f"<quadwright.Attribute: {self.kind or 'anything'} per {self.per or 'anything'}, shape {np.shape(self.values)}>"


def _kind_of(attribute, key, array):
    if attribute.kind:
        return attribute.kind
    known = _WELL_KNOWN.get(attribute.name or key)
    if known and array.dtype.kind == "f" and array.ndim > 1 and _RULES[known][0] <= array.shape[-1] <= _RULES[known][1]:
        return known
    return "labels" if array.dtype.kind in "iub" and (array.ndim == 1 or array.shape[-1] == 1) else "values"


def _domain_of(attribute, array, kind, counts, where):
    rows = {"vertex": counts[0], "corner": counts[1], "face": counts[2]}
    if attribute.per:
        wanted = [attribute.per]
    elif array.ndim == 3:
        wanted = ["corner"]
    else:
        wanted = [per for per in _RULES[kind][2] if rows[per] == len(array)]
    told = f"{counts[0]} vertices, {counts[1]} corners and {counts[2]} faces"
    if len(wanted) > 1:
        raise ValueError(f"{where}: {len(array)} rows, and the mesh has {told}: say which by Attribute(..., per=...)")
    if not wanted or rows[wanted[0]] != len(array) * (array.shape[1] if array.ndim == 3 else 1):
        raise ValueError(f"{where}: {len(array)} rows{' per ' + attribute.per if attribute.per else ''}, but the mesh has {told}")
    return wanted[0]


def _finite(array, where):
    if not np.isfinite(array).all():
        at = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"{where}: {array[tuple(at)]} at row {at[0]}")
    return array


def _labels(array, names, where):
    if array.dtype.kind not in "iub":
        raise TypeError(f"{where}: labels are whole numbers, not {array.dtype}")
    least, most = (int(array.min()), int(array.max())) if array.size else (0, 0)
    lowest, highest = (-2**31, 2**31 - 1) if names is None else (-1, len(names) - 1)
    if array.size and (least < lowest or most > highest):
        told = "are not of 32 bits" if names is None else f"but there are names for 0 to {highest}"
        raise ValueError(f"{where}: label {least if least < lowest else most}, {told}")
    return np.ascontiguousarray(array.reshape(-1), dtype=np.int32)


def _groups(groups, array, where):
    if groups is None:
        raise ValueError(f"{where}: weights need groups")
    groups = _input.array(groups, where)
    if groups.dtype.kind not in "iu":
        raise TypeError(f"{where}: groups are whole numbers, not {groups.dtype}")
    if groups.shape != array.shape:
        raise ValueError(f"{where}: groups of the shape {groups.shape}, but weights of {array.shape}")
    if groups.size and (int(groups.min()) < 0 or int(groups.max()) >= 2**32):
        raise ValueError(f"{where}: groups go from 0 to 4294967295")
    if (array < 0).any():
        raise ValueError(f"{where}: a weight is below 0")
    return np.ascontiguousarray(groups, dtype=np.uint32)


def _name(name, where, what="a name"):
    if not isinstance(name, str):
        raise TypeError(f"{where}: {what} must be a str, not {name!r:.40}")
    if any(ord(letter) < 32 or ord(letter) == 127 for letter in name):
        raise ValueError(f"{where}: {what} has a control character: {name!r:.40}")
    try:
        name.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        raise ValueError(f"{where}: {what} is no text: {name!r:.40}") from None
    return name


def _take_one(key, value, counts):
    where = f"attributes[{key!r:.60}]"
    attribute = value if isinstance(value, Attribute) else Attribute(value)
    name = _name(key if attribute.name is None else attribute.name, where)
    if not name:
        raise ValueError(f"{where}: the name is empty")
    array = _input.array(attribute.values, where)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{where}: numbers are needed, not {array.dtype}")
    if not 1 <= array.ndim <= 3:
        raise ValueError(f"{where}: the shape must be (n,), (n, k) or (faces, corners, k), not {array.shape}")
    kind = _kind_of(attribute, key, array)
    domain = _domain_of(attribute, array, kind, counts, where)
    least, most, domains = _RULES[kind]
    if domain not in domains:
        raise ValueError(f"{where}: {kind} go by {' or '.join(domains)}, not by {domain}")
    components = 1 if array.ndim == 1 else array.shape[-1]
    if not least <= components <= most:
        raise ValueError(f"{where}: {components} columns; {kind} have {least} to {most}" if least < most else
                         f"{where}: {components} columns; {kind} have {least}")
    storage = attribute.storage or (array.dtype.name if array.dtype.name in _STORAGES[2:] else "int32" if kind == "labels" else "float32")
    names = None if attribute.names is None else [_name(n, where, "a label's name") for n in attribute.names]
    groups = None
    if kind == "labels":
        array = _labels(array, names, where)
    else:
        if names is not None and kind != "weights":
            raise ValueError(f"{where}: only labels and the groups of weights have names")
        if name == "color" and array.dtype == np.uint8:
            array = array / np.float32(255)
        with np.errstate(over="ignore"):
            array = _finite(np.ascontiguousarray(array, dtype=np.float32), where)
        groups = _groups(attribute.groups, array, where) if kind == "weights" else None
    return name, DOMAINS.index(domain), KINDS.index(kind), components, array, groups, names, _STORAGES.index(storage)


def counts_of(mesh):
    """Vertices, corners and faces of _input.Arrays."""
    points, _, sizes, corners, _ = mesh
    return len(points), corners.size, len(corners) if sizes is None else len(sizes)


def take(attributes, counts):
    """Tuples for the extension. counts: of counts_of."""
    try:
        items = list(attributes.items())
    except AttributeError:
        raise TypeError(f"attributes: must be a dict of names and arrays, not {attributes!r:.60}") from None
    return [_take_one(_name(key, "attributes"), value, counts) for key, value in items]


def give(tuples):
    """The dict of Attribute of tuples of the extension: values are views of their memory."""
    attributes = {}
    for name, domain, kind, _, data, groups, names, storage, _ in tuples:
        key = f"{name} per {DOMAINS[domain]}" if name in attributes else name  # colours of vertices and of faces
        attributes[key] = Attribute(np.asarray(data), DOMAINS[domain], KINDS[kind], groups=None if groups is None else np.asarray(groups),
                                    names=names, storage=_STORAGES[storage], name=name)
    return attributes


def label_text(region):
    """A label as --region has it."""
    return _name(region, "region", "a label")


_BORDERS = {"seams": "uv", "materials": "material", "groups": "group", "objects": "object"}  # as of the command line's --keep


def border_names(keep):
    """"uv,material" of keep="seams,materials" or a list of such."""
    names = [n.strip() for n in keep.split(",")] if isinstance(keep, str) else keep
    try:
        names = [_name(n, "keep") for n in names]
    except TypeError:
        raise TypeError(f"keep: must be a str or a list of them, such as 'seams,materials', not {keep!r:.60}") from None
    if not all(names) or not names or any("," in n for n in names):
        raise ValueError(f"keep: must be seams, materials, groups or names of attributes, not {keep!r:.60}")
    return ",".join(dict.fromkeys(_BORDERS.get(n, n) for n in names))


# ---------------------------------------------------------------------------------------------------------------------------- steering


class Guide:
    """A polyline on the surface, or nearer to it than half an edge of the quads.

    points: (k, 3). kind: "loop", edges of the result lie on it; "direction", quads run along it. closed: the last point is joined to the first.
    rings: of a closed loop, closed rings of quads wanted on each side of it.
    """

    __slots__ = ("points", "kind", "closed", "rings")

    def __init__(self, points, kind="loop", closed=False, rings=0):
        if not (isinstance(kind, str) and kind in ("loop", "direction")):
            raise ValueError(f"kind: must be loop or direction, not {kind!r:.40}")
        if isinstance(rings, bool) or not isinstance(rings, numbers.Integral) or not 0 <= rings <= 1000:
            raise ValueError(f"rings: must be a number from 0 to 1000, not {rings!r:.40}")
        if rings and not (closed and kind == "loop"):
            raise ValueError("rings: belong to closed loops")
        self.points, self.kind, self.closed, self.rings = points, kind, bool(closed), int(rings)

    def __repr__(self):
        rings = f", {self.rings} rings on each side" if self.rings else ""
        return f"<quadwright.Guide: {'closed ' if self.closed else ''}{self.kind} of {len(self.points)} points{rings}>"


def is_path(value):
    return isinstance(value, (str, bytes, os.PathLike))


def guides(value):
    """Tuples for the extension, or a path."""
    if value is None or is_path(value):
        return [] if value is None else os.fspath(value)
    try:
        listed = list(value)
    except TypeError:
        raise TypeError(f"guides: must be a list of polylines, not {value!r:.60}") from None
    taken = []
    for i, guide in enumerate(listed):
        guide = guide if isinstance(guide, Guide) else Guide(guide)
        points = _input.positions(guide.points, f"guides[{i}]")
        if len(points) < (3 if guide.closed else 2):
            raise ValueError(f"guides[{i}]: {len(points)} points; {3 if guide.closed else 2} or more are needed")
        taken.append((points, 1 if guide.kind == "loop" else 0, guide.closed, guide.rings))
    return taken


def field(value, counts):
    """(directions or path or None, domain)."""
    if value is None or is_path(value):
        return None if value is None else os.fspath(value), 0
    per = None
    if isinstance(value, Attribute):
        value, per = value.values, value.per
    array = _input.array(value, "field")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"field: numbers are needed, not {array.dtype}")
    vertices, _, faces = counts
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"field: the shape must be (vertices, 3) or (faces, 3), not {array.shape}")
    if per is None and vertices == faces == len(array):
        raise ValueError(f"field: the mesh has {vertices} vertices and as many faces: say which by Attribute(field, per=...)")
    per = per or ("vertex" if len(array) == vertices else "face")
    if per == "corner" or len(array) != (vertices if per == "vertex" else faces):
        raise ValueError(f"field: {len(array)} rows, but the mesh has {vertices} vertices and {faces} faces")
    with np.errstate(over="ignore"):
        return _finite(np.ascontiguousarray(array, dtype=np.float32), "field"), DOMAINS.index(per)


def density(value, counts):
    if value is None:
        return None
    array = _input.array(value, "density")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"density: numbers are needed, not {array.dtype}")
    if array.shape != (counts[0],):
        raise ValueError(f"density: the shape must be ({counts[0]},), one number a vertex, not {array.shape}")
    least, most = 1e-3, 1e3  # QW_LEAST_DENSITY, QW_MOST_DENSITY
    wrong = ~((array >= np.float32(least)) & (array <= most))
    if wrong.any():
        v = int(np.argmax(wrong))
        raise ValueError(f"density: {array[v]} at vertex {v}; {least} to {most} are allowed")
    return np.ascontiguousarray(array, dtype=np.float32)


def region(value, counts):
    """uint8 (faces,), 1 inside."""
    array = _input.array(value, "region")
    if array.dtype.kind not in "biu":
        raise TypeError(f"region: True or False for each face are needed, not {array.dtype}")
    if array.shape != (counts[2],):
        raise ValueError(f"region: the shape must be ({counts[2]},), one a face, not {array.shape}")
    if array.size and (int(array.min()) < 0 or int(array.max()) > 1):
        raise ValueError(f"region: face {int(np.argmax((array < 0) | (array > 1)))} is neither inside, 1, nor outside, 0")
    return np.ascontiguousarray(array, dtype=np.uint8)


class Provenance:
    """Where a result lies on its input.

    vertices, corners: structured arrays, a row for each vertex of the result and for each corner of its quads (quads.reshape(-1)), of
    "face", int32: a face of the input, or -1 where nothing near faces the same way;
    "corner", int32 (3,): three corners of that face, counted from 0 within it: 0, 1, 2 of a triangle;
    "weight", float32 (3,): barycentric coordinates for these, 0 to 1, 1 together.
    lost_vertices, lost_corners: how many have face -1. farthest: the largest distance of a vertex from its place, in the units of the input.
    """

    def __init__(self, told):
        vertices, corners, self.lost_vertices, self.lost_corners, self.farthest = told
        self.vertices, self.corners = np.asarray(vertices), np.asarray(corners)

    def __repr__(self):
        return f"<quadwright.Provenance: {len(self.vertices)} vertices, {self.lost_vertices} without a place>"
