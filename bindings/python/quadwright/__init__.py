"""Any triangle surface in, a clean all-quad mesh out.

    import quadwright
    result = quadwright.remesh(vertices, faces, faces=5000)
    result.vertices, result.quads, result.report["topology"]["irregular"]
    result.save("quads.obj")

vertices: (n, 3), numbers; faces: (m, 3) or (m, 4), whole numbers from 0, or (corners,) with face_sizes. Arrays of any numeric type and layout
are taken; float64 and int32 in C order are not copied on the way. A mesh of trimesh or meshio may stand in the place of both, and brings its
attributes along.

remesh(), load(), save(), measure() and render() release the global interpreter lock and hear Ctrl-C. A Remesher copies what it is given; arrays that are
saved, measured or drawn must not be changed by other threads meanwhile.

A failure is an exception: quadwright.Error, with a class for each status of the library. What is wrong with an argument is a TypeError,
ValueError or IndexError that begins with the argument's name, before anything is computed.
"""
import base64
import dataclasses
import difflib
import html
import inspect
import json
import logging
import operator
import os
import re
import sys
import tempfile
import time
import urllib.parse
import warnings

import numpy as np

from . import _attributes, _input, _native, _others
from ._attributes import Attribute, Guide, Provenance

__version__ = _native.version
_logger = logging.getLogger("quadwright")

# ---------------------------------------------------------------------------------------------------------------------------- failures


class Error(Exception):
    """A failure of the library. status: its name; exit_code: that of the command line tool."""

    status = "INTERNAL"
    exit_code = 21


_BUILTIN_BASES = {
    "ARGUMENT": ValueError, "OPTION": ValueError, "FILE_MISSING": FileNotFoundError, "FILE_UNREADABLE": OSError,
    "FILE_IS_DIRECTORY": IsADirectoryError, "FILE_UNWRITABLE": OSError, "INDEX_RANGE": IndexError, "NOT_FINITE": ValueError,
    "NO_FACES": ValueError, "ONLY_DEGENERATE": ValueError, "MEMORY": MemoryError, "UNSUPPORTED": NotImplementedError,
}


def _make_error(name, text, exit_code):
    if name == "OK":
        return Error
    title = "".join(word.capitalize() for word in name.split("_"))
    bases = (Error, _BUILTIN_BASES[name]) if name in _BUILTIN_BASES else (Error,)
    fields = {"__doc__": f"{text[0].upper()}{text[1:]}.", "__module__": __name__, "status": name, "exit_code": exit_code}
    class_name = {"CANCELLED": "Cancelled", "MEMORY": "OutOfMemoryError"}.get(name, f"{title}Error")
    return type(class_name, bases, fields)


_errors = [_make_error(*row) for row in _native.statuses()]
_native.set_errors(_errors)
globals().update({error.__name__: error for error in _errors})


class TimeLimitError(Cancelled, TimeoutError):  # noqa: F821
    """The time limit was reached."""

    status = "TIME_LIMIT"


# ----------------------------------------------------------------------------------------------------------------------------- options

_OLD = {"faces_wanted": "faces", "vertices_wanted": "vertices"}  # old names, taken with a notice
_OTHERS_WORDS = dict.fromkeys(("target_faces", "target_face_count", "target_count", "target", "n_faces", "num_faces", "face_count", "count", "quads", "target_quads"), "faces")
_table = {row[0]: row for row in _native.options()}
_of_assets = {row[0]: row for row in _native.asset_options()}
_presets = {row[0]: {"options": dict(setting.split("=") for setting in row[1].split()), "help": row[2]} for row in _native.presets()}

CANCEL = "cancel"  # what a progress function returns to cancel a run, at every host; None goes on


def presets():
    """The presets, as {name: {"options": {name: text}, "help"}}."""
    return {name: {"options": dict(row["options"]), "help": row["help"]} for name, row in _presets.items()}


def options():
    """The options, as {name: {"kind", "default", "least", "most", "unit", "choices", "help"}}; those of texture coordinates and maps come last."""
    return {name: {"kind": row[1], "default": _default(row), "least": row[2 + 1], "most": row[2 + 2], "unit": row[5],
                   "choices": row[6].split("|") if row[6] else None, "help": row[7]} for name, row in {**_table, **_of_assets}.items()}


def _default(row):
    name, kind, initial, choices = row[0], row[1], row[2], row[6]
    if kind == "flag":
        return bool(initial)
    if kind == "choice":
        return choices.split("|")[int(initial)]
    if name in ("faces", "vertices", "edge_length", "ratio"):
        return None  # 0 in the library: not asked for
    return int(initial) if kind == "count" else initial


def _pairs(given):
    pairs = []
    for name, value in given.items():
        if name in _OLD:
            warnings.warn(f"{name} is now called {_OLD[name]}", DeprecationWarning, stacklevel=4)
            name = _OLD[name]
        if name not in _table:
            near = [_OTHERS_WORDS[name]] if name in _OTHERS_WORDS else difflib.get_close_matches(name, [*_table, *_of_assets], 1)
            raise TypeError(f"remesh() has no option {name!r}" + (f"; did you mean {near[0]}?" if near else ""))
        if name in ("faces", "vertices") and np.ndim(value):
            raise TypeError(f"{name}: the number of quads wanted is one number; arrays of the mesh are the first two arguments, without a name")
        if name == "symmetry" and value is not None and not isinstance(value, str):
            pairs.append((name, _plane(value)))
        elif name == "wrap" and value is not None and not isinstance(value, (bool, np.bool_)):
            pairs.append((name, value if isinstance(value, str) and value.isprintable() else _input.option_text(name, "real", value)))
        elif value is not None:
            pairs.append((name, _input.option_text(name, _table[name][1], value)))
    return pairs


def _maps(bake):
    """The maps that are asked for, as a number; -1: none."""
    if bake is None or bake is False:
        return -1
    if not isinstance(bake, str):
        try:
            bake = ",".join(bake)
        except TypeError:
            raise TypeError(f"bake: must be a str or a list of them, such as 'color,normal', not {bake!r:.60}") from None
    try:
        return _native.maps(bake)
    except ValueError as error:
        raise ValueError(re.sub("^bake ", "bake: ", str(error))) from None


def _of_asset(options):
    """The options of texture coordinates and maps, as pairs of texts; they are taken out of the others."""
    given = {name: options.pop(name) for name in _of_assets if name in options}
    return [(name, _input.option_text(name, _of_assets[name][1], value)) for name, value in given.items() if value is not None]


def _preset(name):
    """The settings of a preset, as pairs of texts."""
    if name is None:
        return []
    if not isinstance(name, str) or name not in _presets:
        raise ValueError(f"preset: must be {', '.join(_presets)}, not {name!r:.40}")
    return [*_presets[name]["options"].items()]


def _own_words(text):
    """A sentence of the library about options, beginning with the name of the argument."""
    return re.sub(r"^option (\w+),? ", r"\1: ", text)


def _plane(value):
    """A plane of symmetry, (x, y, z, offset), as the library takes it."""
    try:
        numbers = [float(number) for number in value]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 4 or not any(numbers[:3]):
        raise TypeError(f"symmetry: must be a str, or (x, y, z, offset) of a plane with a normal x, y, z other than 0, not {value!r:.60}")
    return ",".join(map(repr, numbers))


def _memory(limit):
    """Bytes of a memory limit: a number of them, or a text such as "4G"."""
    if isinstance(limit, str):
        return _told("memory_limit", _native.memory_size, limit)
    try:
        limit = operator.index(limit)
    except TypeError:
        raise TypeError(f"memory_limit: must be a whole number of bytes, or such as '4G', not {limit!r:.60}") from None
    if not 0 <= limit < 2**63:
        raise ValueError(f"memory_limit: must be 0 or more bytes, not {limit}")
    return limit


def _seconds(limit):
    """When a time limit of so many seconds from now is over."""
    try:
        seconds = float(limit)
    except (TypeError, ValueError):
        seconds = 0
    if isinstance(limit, (bool, str)) or not seconds > 0:
        raise ValueError(f"time_limit: must be a number of seconds above 0, or None, not {limit!r:.60}")
    return time.monotonic() + seconds


def _answer(progress, time_limit):
    """The function for the extension, which cancels at CANCEL. False, which cancelled before there was that, still does, with a notice."""
    end = None if time_limit is None else _seconds(time_limit)
    if end is None and not progress:
        return None

    def tell(stage, fraction):
        if end is not None and time.monotonic() > end and fraction < 1:
            raise TimeLimitError(f"time_limit: {time_limit} s are over, in {stage}")
        answer = progress(stage, fraction) if progress else None
        if answer is False:
            warnings.warn("progress: return quadwright.CANCEL to cancel; False does so for now", DeprecationWarning, stacklevel=2)
        return answer is not False and not (isinstance(answer, str) and answer == CANCEL)

    return tell


def _with_options(function):
    parameters = [p for p in inspect.signature(function).parameters.values() if p.kind is not p.VAR_KEYWORD]
    if all(p.name != "preset" for p in parameters):
        parameters.append(inspect.Parameter("preset", inspect.Parameter.KEYWORD_ONLY, default=None))
    rows = {**_table, **_of_assets}
    for name, row in rows.items():
        parameters.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_default(row)))
    function.__signature__ = inspect.Signature(parameters)
    lines = [f"        {name} ({row[6].replace('|', ', ') if row[6] else row[5] or 'True or False'}; {_default(row)}): {row[7]}" for name, row in rows.items()]
    function.__doc__ = f"{function.__doc__.rstrip()}\n\n    Options (unit, or values; default):\n" + "\n".join(lines) + "\n"
    return function


# -------------------------------------------------------------------------------------------------------------------- log and progress

_LEVELS = (logging.DEBUG, logging.INFO, logging.WARNING)


def _log(level, message):
    _logger.log(_LEVELS[level], "%s", message)


class _Bar:
    """A bar on standard error: tqdm's where it is installed."""

    def __init__(self):
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.bar = None
        else:
            self.bar = tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}")
        self.shown = -1

    def __call__(self, stage, fraction):
        percent = int(100 * fraction)
        if percent == self.shown:
            return
        self.shown = percent
        if self.bar is None:
            print(f"\r{percent:3d} % {stage:<32}", end="\n" if fraction >= 1 else "", file=sys.stderr, flush=True)
            return
        self.bar.set_description(stage)
        self.bar.n = percent
        self.bar.refresh()

    def close(self):
        if self.bar is not None:
            self.bar.close()


# ------------------------------------------------------------------------------------------------------------------------------ results


class _Report(dict):
    """A report of a run, with one name a figure of qw_report in quadwright.h; json.dumps() writes it."""

    def __init__(self, text):
        super().__init__(json.loads(text))

    def __reduce__(self):
        return _Report, (json.dumps(dict(self)),)

    def __repr__(self):
        return f"<report of {len(self)} figures: {self['topology']['quads']} quads, {self['faces_asked']} asked for>"


class _Meshlike:
    """What meshes and results have in common."""

    def save(self, path, format="auto"):
        """Writes OBJ, PLY, OFF, GLB, glTF, or for simulation MSH, VTU, INP or BDF, by the ending of the name, with the attributes; the file is whole or untouched."""
        save(path, self, format=format)

    def to_trimesh(self):
        """A trimesh.Trimesh with the attributes of vertices and faces; polygons are cut into triangles."""
        import trimesh

        kinds = {"vertex": {}, "face": {}, "corner": {}}
        for name, attribute in self.attributes.items():
            kinds[attribute.per][name] = attribute.values
        repeated = {name: values[self._triangle_faces()] for name, values in kinds["face"].items()}
        colours = kinds["vertex"].pop("color", None), repeated.pop("color", None)
        return trimesh.Trimesh(vertices=self.vertices, faces=self._triangles(), process=False, vertex_attributes=kinds["vertex"],
                               face_attributes=repeated, vertex_colors=colours[0], face_colors=colours[1])

    def to_meshio(self):
        """A meshio.Mesh with the attributes of vertices and faces."""
        import meshio

        rows = self._block_rows()
        of_points = {name: a.values for name, a in self.attributes.items() if a.per == "vertex"}
        of_cells = {name: [a.values[r] for r in rows] for name, a in self.attributes.items() if a.per == "face"}
        return meshio.Mesh(self.vertices, self._blocks(), point_data=of_points, cell_data=of_cells)

    def to_vtk(self):
        """A vtkPolyData with the attributes of vertices and faces; quads stay quads."""
        return _others.to_vtk(self, self._sizes())

    def to_pyvista(self):
        """A pyvista.PolyData with the attributes of vertices and faces; quads stay quads."""
        import pyvista

        return pyvista.wrap(self.to_vtk())

    def to_open3d(self):
        """An open3d.geometry.TriangleMesh with vertex colours and materials; polygons are cut into triangles, as Open3D has no others."""
        return _others.to_open3d(self, self._triangles(), self._triangle_faces())

    def _sizes(self):
        return np.full(len(self.faces), self.faces.shape[1]) if self.face_sizes is None else self.face_sizes

    def _triangle_faces(self):
        sizes = self._sizes()
        return np.repeat(np.arange(len(sizes)), sizes - 2)

    def _triangles(self):
        """Fans of the polygons."""
        if self.face_sizes is None and self.faces.shape[1] == 3:
            return self.faces
        sizes, of = self._sizes(), self._triangle_faces()
        first = (np.cumsum(sizes) - sizes)[of]
        step = np.arange(len(of)) - (np.cumsum(sizes - 2) - (sizes - 2))[of] + 1
        corners = self.faces.reshape(-1)
        return np.stack([corners[first], corners[first + step], corners[first + step + 1]], -1)

    def _block_rows(self):
        if self.face_sizes is None:
            return [slice(None)]
        return [np.flatnonzero(self.face_sizes == size) for size in dict.fromkeys(self.face_sizes.tolist())]

    def _blocks(self):
        names = {3: "triangle", 4: "quad"}
        if self.face_sizes is None:
            return [(names[self.faces.shape[1]], self.faces)]
        sizes, begin = self.face_sizes, np.cumsum(self.face_sizes) - self.face_sizes
        return [(names.get(int(sizes[r[0]]), "polygon"), self.faces[begin[r][:, None] + np.arange(sizes[r[0]])]) for r in self._block_rows()]

    def __getstate__(self):
        return {**self.__dict__, "scene": None}  # what a file holds beside its surface stays behind when this is pickled

    def _picture(self, width=640, height=480):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            render(self, path, width=width, height=height, views=1)
            with open(path, "rb") as file:
                return file.read()

    def _figure(self, rows):
        cells = "".join(f"<tr><th style='text-align:left'>{html.escape(n)}</th><td>{html.escape(str(v))}</td></tr>" for n, v in rows)
        picture = base64.b64encode(self._picture()).decode("ascii")
        return (f"<div style='display:flex;align-items:center'><img alt='mesh' width='480' src='data:image/png;base64,{picture}'>"
                f"<table>{cells}</table></div>")


class Result(_Meshlike):
    """Quads of a surface.

    vertices: float64 (n, 3), in the units of the input; quads: int32 (m, 4), counter-clockwise from outside. Both are views of the result's
    memory, which lives as long as any of them, as are those of all else. faces: the quads; of a run with a region the quads, and behind them the
    polygons that stayed: int32 (k, 4), or (corners,) where face_sizes, int32 (k,), is not None; attributes and provenance go by these. report: a dict, as the command line tool's --json has it.
    attributes: {name: Attribute}, of those of the input, in their order; texture coordinates go by corners. transfer: what was carried, a dict of
    counts, or None. maps: {name: array}, what was baked: uint8 or, of height, uint16 (texels, texels, channels), color with alpha where a material has it, the upper row first; of several
    tiles ("color.1002") the second and so on as UDIM numbers them. asset: figures of the texture coordinates and maps, a dict, or None.
    save() writes the maps too. provenance: a Provenance where it was asked for or attributes were carried, else None. field: float32 (vertices or faces of
    the input, 3), a direction of each cross that the quads followed, or None. coarse: with subdivide, (vertices, quads) of what was split, level 0: its
    vertices are the first of the result, and quad f became the quads 4 ** subdivide * f and on; else None. creases: with fit_to="limit", int32 (k, 2), vertices of edges that are infinitely sharp creases of the Catmull-Clark surface, of corners
    twice the same, of level 0 where quads were split; None where there is none. library: the mtllib of the OBJ file that the surface is from. scene: what
    its glTF file holds beside it, which save() writes into a .glb or .gltf; or None.
    """

    def __init__(self, told, normals="input", library=None, scene=None, context=None):
        (positions, _, sizes, corners, marks), report, attributes, self.transfer, provenance, field, shaded, asset, coarse = told
        self.vertices = np.asarray(positions)
        self.faces = np.asarray(corners)
        self.face_sizes = None if sizes is None else np.asarray(sizes)
        self.report = _Report(report)
        made = len(self._sizes()) - self.report["kept_faces"]
        self.quads = self.faces[:made] if sizes is None else self.faces[:4 * made].reshape(-1, 4)
        carried = _attributes.give(attributes)
        if normals != "input":
            carried = {name: attribute for name, attribute in carried.items() if attribute.kind != "normals"}
        self.attributes = {**carried, **_attributes.give(shaded)}
        self.provenance = None if provenance is None else Provenance(provenance)
        self.field = None if field is None else np.asarray(field)
        self.coarse = None if coarse is None else (np.asarray(coarse[0]), np.asarray(coarse[3]))
        creases = marks if coarse is None else coarse[4]
        self.creases = None if creases is None else np.asarray(creases)
        self.library = library
        self.scene = scene
        self.asset, self.maps, self._run = None, {}, None
        if asset is not None:
            self._take_asset(asset, context)

    def _take_asset(self, asset, context):
        uv, report, images, number = asset
        own = {name: attribute for name, attribute in self.attributes.items() if attribute.kind != "uvs"}
        self.attributes = {**own, **_attributes.give(uv)}
        self.asset = json.loads(report)
        for name, tile, height, width, channels, data in images:
            key = f"{name}.{1001 + tile}" if tile else name
            self.maps[key] = np.asarray(data).reshape(height, width, channels)
        if images:
            self._run = (context, number)  # the maps are written from there

    def save(self, path, format="auto"):
        """Writes OBJ, PLY, OFF, GLB or glTF, by the ending of the name, with the attributes; the file is whole or untouched. A result with maps is
        written with these as its material: GLB and glTF hold the pictures, beside an OBJ lie an MTL and PNG files."""
        if not self.maps:
            return save(path, self, format=format)
        if self._run is None:
            raise RuntimeError("maps: those of a copy are not written; save the result itself")
        context, number = self._run
        context.save_asset(number, path, _format_of(path, format))

    def __getstate__(self):
        return {**super().__getstate__(), "_run": None}

    def measure(self, against=None):
        """Every figure of the quads; see quadwright.measure. Of a wrapped surface what is seen from outside counts."""
        return measure(self, against=against, gap=self.report["wrap_distance"])

    def __repr__(self):
        return f"<quadwright.Result: {len(self.quads)} quads, {len(self.vertices)} vertices>"

    def _repr_html_(self):
        report, topology = self.report, self.report["topology"]
        return self._figure([("quads", len(self.quads)), ("asked for", report["faces_asked"]), ("vertices", len(self.vertices)),
                             ("irregular", topology["irregular"] + topology["irregular_boundary"]),
                             ("angles off by", f"{report['angle_rms']:.1f} degrees"), ("areas by", f"{100 * report['area_cv']:.0f} %"),
                             ("in simple rows", f"{100 * report['simple']:.0f} %"),
                             ("seconds", f"{report['seconds']:.2f}")])


@dataclasses.dataclass(eq=False)
class Mesh(_Meshlike):
    """A mesh of a file. faces: int32 (m, 3) or (m, 4); or (corners,) where face_sizes, int32 (m,), is not None. marked_edges: int32 (k, 2), those
    that the file marks as sharp, or None. attributes: {name: Attribute}, those of the file: of OBJ "uv", "normal", "color", and labels "object",
    "group", "material", "smoothing"; of PLY all properties by their names; of glTF docs/attributes.md tells. library: the mtllib of an OBJ file, or None. scene: nodes,
    materials, images, skins and animations of a glTF file, or None."""

    vertices: np.ndarray
    faces: np.ndarray
    face_sizes: "np.ndarray | None" = None
    marked_edges: "np.ndarray | None" = None
    attributes: dict = dataclasses.field(default_factory=dict)
    library: "str | None" = None
    scene: object = dataclasses.field(default=None, repr=False)

    def __repr__(self):
        count = len(self.faces) if self.face_sizes is None else len(self.face_sizes)
        return f"<quadwright.Mesh: {count} faces, {len(self.vertices)} vertices>"

    def _repr_html_(self):
        return self._figure([("faces", len(self.faces) if self.face_sizes is None else len(self.face_sizes)), ("vertices", len(self.vertices))])


# ---------------------------------------------------------------------------------------------------------------------------- remeshing


def _told(argument, function, *arguments):
    """What a function of the extension tells; the message of its failure begins with the argument's name."""
    try:
        return function(*arguments)
    except Error as error:
        raise type(error)(f"{argument}: {error}") from None
    except ValueError as error:  # the name of a file that can be none
        raise ValueError(f"{argument}: {error}") from None


def _points(arrays):
    return _told("vertices", _native.points, arrays)


_SHADINGS = {"input": -1, "none": -1, "smooth": 0, "split": 1}  # qw_shading


class Remesher:
    """A surface that is remeshed more than once: what two runs have in common is made once, and the results are those of fresh runs.

    Arguments as of remesh(). All of them are copied. One thread at a time; a Remesher a thread.
    """

    def __init__(self, vertices, faces=None, /, *, face_sizes=None, marked_edges=None, attributes=None, keep=None, density=None, guides=None,
                 field=None, region=None, memory_limit=0):
        mesh = _input.take_points(vertices, _points) if faces is None and face_sizes is None and marked_edges is None else None
        if mesh is None:
            mesh = _input.take(vertices, faces, face_sizes, marked_edges)
        self._of_points = mesh.of_points
        self._defaults = {"sharp_marks": True} if marked_edges is not None and mesh[4] is not None else {}
        bare = attributes is not None and not attributes
        self._library, self._scene = (None, None) if bare else (mesh.library, mesh.scene)
        self._mesh = mesh
        self._counts = _attributes.counts_of(mesh)
        tuples = _attributes.take(mesh.own if attributes is None else attributes, self._counts)
        if keep is not None:
            mesh = self._mesh = self._keep(mesh, tuples, keep, marked_edges)
        self._context = _native.Context(_memory(memory_limit))
        self._context.set_mesh(mesh)
        self._context.set_attributes(tuples)
        if isinstance(region, str):
            names = _attributes.label_text(region)
            region = _told("region", _native.region, mesh, tuples, names)
        for value, setter in ((region, self.set_region), (density, self.set_density), (guides, self.set_guides), (field, self.set_field)):
            if value is not None:
                setter(value)

    def _keep(self, mesh, tuples, keep, marked_edges):
        """The mesh with marks where attributes differ, beside those that were handed in."""
        marks = np.asarray(_told("keep", _native.borders, mesh, tuples, _attributes.border_names(keep)))
        if marked_edges is not None and mesh[4] is not None:
            marks = np.concatenate([mesh[4].reshape(-1, 2), marks])
        self._defaults["keep_marks"] = True
        return _input.Arrays((*mesh[:4], marks if len(marks) else None))

    def set_region(self, region):
        """Another region for the next runs, (faces,), True inside; None: the whole surface."""
        _told("region", self._context.set_region, None if region is None else _attributes.region(region, self._counts))

    def set_density(self, density):
        """Another density for the next runs, as of remesh(); None: none."""
        _told("density", self._context.set_density, _attributes.density(density, self._counts))

    def set_guides(self, guides):
        """Other guides for the next runs, as of remesh(); None: none."""
        _told("guides", self._context.set_guides, _attributes.guides(guides))

    def set_field(self, field):
        """Another cross field for the next runs, as of remesh(); None: none."""
        _told("field", self._context.set_field, *_attributes.field(field, self._counts))

    def remesh(self, *, preset=None, progress=None, time_limit=None, normals="input", provenance=False, field_per=None, most_weights=0, unwrap=False, bake=None, **options):
        """Remeshes the surface with these options: a Result of its own. One with maps is saved before the next run."""
        maps, of_asset = _maps(bake), _of_asset(options)
        asset = (of_asset, maps, tuple(self._mesh), self._scene) if unwrap or maps >= 0 else None
        pairs = _preset(preset) + _pairs({**self._defaults, **options})
        if self._of_points and dict(pairs).get("wrap", "off") == "off":
            raise TypeError("faces: missing; points alone become a surface with wrap=True, or give vertices and faces, or a mesh that has both")
        if progress is not None and progress is not True and progress is not False and not callable(progress):
            raise TypeError(f"progress: must be callable as progress(stage, fraction), or True for a bar, not {progress!r:.60}")
        if field_per is not None and not (isinstance(field_per, str) and field_per in ("vertex", "face")):
            raise ValueError(f"field_per: must be vertex or face, not {field_per!r:.40}")
        if not isinstance(most_weights, (int, np.integer)) or not 0 <= most_weights <= 16:
            raise ValueError(f"most_weights: must be 0 to 16, not {most_weights!r:.40}")
        if not isinstance(normals, str) or normals not in _SHADINGS:
            raise ValueError(f"normals: must be {', '.join(_SHADINGS)}, not {normals!r:.40}")
        bar = _Bar() if progress is True else None
        try:
            log = _log if _logger.isEnabledFor(logging.WARNING) else None
            per = -1 if field_per is None else _attributes.DOMAINS.index(field_per)
            told = self._context.run(pairs, _answer(bar or progress, time_limit), log, bool(provenance), int(most_weights), per, _SHADINGS[normals], asset)
        except OptionError as error:  # noqa: F821
            raise OptionError(_own_words(str(error))) from None  # noqa: F821
        except ArgumentError as error:  # noqa: F821
            if str(error).startswith("guide "):
                raise ArgumentError(f"guides: {error}") from None  # noqa: F821
            raise
        finally:
            if bar:
                bar.close()
        result = Result(told, normals, self._library, self._scene, self._context)
        if asset is None:
            idle = [f"option {name} has no effect without unwrap or bake" for name, _ in of_asset]
            result.report.update(warnings=[*result.report["warnings"], *idle], warning_count=result.report["warning_count"] + len(idle))
        return result

    def save_patches(self, path, patches_from="quads"):
        """Writes the limit surface of the last run's quads as STEP: a bicubic patch a quad, or, from "blocks", planes, cylinders and cones of a
        designed part, and elsewhere a B-spline surface for each grid of quads between the lines that leave irregular vertices and sharp edges. Best with fit_to="limit"; closed surfaces are solids."""
        if patches_from not in ("quads", "blocks"):
            raise ValueError(f"patches_from: must be quads or blocks, not {patches_from!r:.40}")
        self._context.save_patches(path, patches_from == "blocks")

    def levels(self, faces, **options):
        """Levels of detail: a Result for each number of quads, in their order. What depends on the surface alone is made once; options as of remesh()."""
        return [self.remesh(faces=count, **options) for count in faces]


@_with_options
def remesh(points, triangles=None, /, *, face_sizes=None, marked_edges=None, attributes=None, keep=None, density=None, guides=None, field=None,
           region=None, preset=None, progress=None, time_limit=None, normals="input", provenance=False, field_per=None, most_weights=0, unwrap=False, bake=None,
           memory_limit=0, **options):
    """Makes quads of a surface: a Result.

    The first two arguments have no names, and sentences call them vertices and faces: (n, 3), finite numbers; (m, 3) or (m, 4), whole numbers from 0
    to n - 1, or (corners,) with face_sizes, (m,), each 3 or more. A mesh of trimesh, meshio, VTK, PyVista or Open3D, a Mesh or a Result
    may stand in the place of both. With wrap=True points without faces may: an array (n, 3), a PointCloud of Open3D, VTK's or PyVista's points; their
    normals are not needed, their colours and values are carried.

    attributes: {name: array or Attribute}, what the surface has of its vertices, corners and faces and the quads are to have too; None: those that
    the mesh brings along; {}: none. Float32 (n,) or (n, k) are interpolated, whole numbers (n,) are labels; Attribute says what else there is.
    marked_edges: (k, 2), vertices of edges that are sharp; turns sharp_marks on unless it is given. keep: "seams", "materials", "groups", names of
    attributes, or several ("seams,materials"): edges of the result follow the borders at which those differ; turns keep_marks on.
    density: (n,), 0.001 to 1000: edges a unit of length, compared with elsewhere. Where it is 2 edges are half as long as where it is 1.
    guides: a list of polylines, (k, 3) or Guide, on the surface: edges lie on them, or quads run along them. field: (n, 3) or (m, 3), a direction of a
    cross for each vertex or face, 0 0 0 where it says nothing. guides and field may be names of files (.obj of lines, .rosy).
    region: (m,), True for the faces that are remeshed; or a label of theirs, "arm" or "material=arm". The others stay as they are, and come behind the quads.

    normals: "input", carried over where there are some; "none"; "smooth" or "split", those of the quads, by vertices or split at sharp edges by corners.
    provenance: True finds where vertices and corners of the result lie on the surface. field_per: "vertex" or "face" of the surface, for which
    the result tells its field. most_weights: pairs kept of weights, 1 to 16; 0: as many as came in.
    unwrap: True gives the quads texture coordinates of their own, "uv", instead of those of the input. bake: maps on them of what the input looks like:
    "input" (normals, and what its materials, textures and colours have), "all", or any of "color", "normal", "orm", "emission", "occlusion" and
    "height", in a list or with commas between them. They are the result's `maps`.
    progress: called with (stage, fraction), at most every 20 ms, on this thread; CANCEL cancels the run (Cancelled), and what it raises comes out of
    remesh(). True shows a bar. time_limit: seconds, after which it is given up (TimeLimitError, which is a Cancelled and a TimeoutError); None: none. memory_limit: bytes, or a text such as "4G"; 0: none.
    preset: "scan", "character", "cad", "game", "print" or "soup", options that suit a kind of surface (presets()); those that are given win.

    symmetry may also be (x, y, z, offset), the plane of the points p with x p0 + y p1 + z p2 = offset. At most one of faces, vertices,
    edge_length and ratio may be given. The global interpreter lock is released. Ctrl-C raises KeyboardInterrupt.

    Raises TypeError, ValueError or IndexError, whose text begins with the name of the argument, for what is no such array or value; an Error of the status
    of the library for what it refuses: OptionError, ArgumentError (a guide that is off the surface, a field of another mesh), NoFacesError,
    OnlyDegenerateError, TooLargeError, OutOfMemoryError (also a MemoryError), UnsupportedError (flow="ilp").
    """
    if isinstance(triangles, (int, float, np.number)):
        raise TypeError(f"faces: the number of quads wanted is given by name, faces={triangles:g}")
    remesher = Remesher(points, triangles, face_sizes=face_sizes, marked_edges=marked_edges, attributes=attributes, keep=keep, density=density,
                        guides=guides, field=field, region=region, memory_limit=memory_limit)
    return remesher.remesh(preset=preset, progress=progress, time_limit=time_limit, normals=normals, provenance=provenance, field_per=field_per, most_weights=most_weights, unwrap=unwrap,
                           bake=bake, **options)


def asset(points, triangles=None, /, *, bake="input", **options):
    """Makes an asset of a surface: quads with texture coordinates of their own, and maps on them of what the surface looks like. A Result.

        result = quadwright.asset(quadwright.load("scan.glb"), faces=5000, texture=2048)
        result.maps["color"].shape, result.asset["charts"]
        result.save("asset.glb")

    All arguments are those of remesh(). docs/asset.md tells of the maps.
    """
    return remesh(points, triangles, bake=bake, **options)


asset.__signature__ = inspect.Signature(
    [p.replace(default="input") if name == "bake" else p for name, p in remesh.__signature__.parameters.items()])


# --------------------------------------------------------------------------------------------------------------------- files, measuring


def load(path, *more):
    """Reads an OBJ, PLY, OFF, STL, GLB or glTF file, judged by its contents: a Mesh, with its attributes. Several files become one Mesh, whose
    asset() has one square of texture coordinates and one set of maps: each is an object, the label "object", by its name without folder and ending.

    Raises FileMissingError (a FileNotFoundError), FileUnreadableError (an OSError), FormatSyntaxError and the like, with the path and the line or element.
    """
    return _loaded(*_native.load([path, *more], _log, _may_be_gltf(path)))


def load_memory(data):
    """The same of the bytes of such a file: bytes, or anything with a buffer of them. What the file names beside itself is not found."""
    head = bytes(memoryview(data).cast("B")[:64]).lstrip(b"\xef\xbb\xbf \t\r\n")
    return _loaded(*_native.load_memory(data, _log, head.startswith((b"glTF", b"{"))))


def _loaded(told, scene):
    (positions, size, sizes, corners, marks), attributes, library = told
    return Mesh(np.asarray(positions), np.asarray(corners), None if sizes is None else np.asarray(sizes),
                None if marks is None else np.asarray(marks), _attributes.give(attributes), library, scene)


def _may_be_gltf(path):
    """Only then the file's own mesh is kept: it holds all that is beside the surface, and the arrays once more."""
    try:
        with open(path, "rb") as file:
            head = file.read(64).lstrip(b"\xef\xbb\xbf \t\r\n")
    except (OSError, ValueError, TypeError):
        return False
    return head.startswith((b"glTF", b"{"))


_FORMATS = {"auto": 0, "obj": 1, "ply": 2, "off": 3, "stl": 4, "glb": 5, "gltf": 6, "msh": 7, "vtu": 8, "inp": 9, "bdf": 10}  # qw_format


def _format_of(path, format):
    """The number of a format, by its name or the ending of the path."""
    if not isinstance(format, str) or format not in _FORMATS:
        raise ValueError(f"format: must be {', '.join(_FORMATS)}, not {format!r:.40}")
    name = os.fsdecode(path)
    if format == "auto":
        format = os.path.splitext(name)[1][1:].lower()
        if format not in _FORMATS or format == "auto":
            raise ValueError(f"path: the ending of {name!r} names no format that can be written; use .{', .'.join(list(_FORMATS)[1:])}, or format")
    return _FORMATS[format]


def save(path, vertices, faces=None, /, *, face_sizes=None, attributes=None, format="auto"):
    """Writes OBJ, PLY (binary, doubles), OFF, STL, GLB or glTF, or for simulation MSH (Gmsh), VTU (VTK), INP (Abaqus) or BDF (Nastran); the file is whole or
    untouched. format: "obj", "ply", "off", "stl", "glb", "gltf", "msh", "vtu", "inp", "bdf", or "auto": by the name.

    attributes: as of remesh(); None: those of the mesh, {}: none. Written as far as the format holds them: OBJ "uv", "normal", "color" and the labels
    "object", "group", "material", "smoothing"; PLY all but weights and normals by corners; OFF "color"; GLB and glTF as docs/attributes.md tells, with the scene of the file that the surface is from. Faces
    are grouped by their labels.
    """
    number = _format_of(path, format)
    mesh = _input.take(vertices, faces, face_sizes)
    tuples = _attributes.take(mesh.own if attributes is None else attributes, _attributes.counts_of(mesh))
    bare = attributes is not None and not attributes
    _native.save(mesh, tuples, None if bare else mesh.library, None if bare else mesh.scene, path, number)


def save_levels(path, levels, *, format="auto"):
    """Writes levels of detail, the finest first, into one GLB or glTF file: a node a level, of which the first names the others (MSFT_lod).

    levels: Results of one surface (Remesher.levels), or other meshes. Materials, textures and images of the surface's file come along. Levels with maps
    of their own are for `quadwright asset --levels`.
    """
    number = _format_of(path, format)
    meshes = [_input.take(level, name=f"level {i}") for i, level in enumerate(levels)]
    if any(getattr(level, "maps", None) for level in levels):
        raise ValueError("levels: those with maps are made by `quadwright asset --levels`")
    listed = [(mesh, _attributes.take(mesh.own, _attributes.counts_of(mesh))) for mesh in meshes]
    _native.save_levels(listed, meshes[0].scene if meshes else None, path, number)


def measure(vertices, faces=None, /, *, face_sizes=None, against=None, gap=0.0):
    """Every figure of a mesh, as a dict with the names of qw_topology and qw_quality; None where one does not apply.

    against: the surface, a mesh or (vertices, faces): for distances and angles to the shape. gap: above 0, only what of it is seen from outside
    counts, through gaps wider than this length.
    """
    surface = None if against is None else _input.take(against, name="against")
    return json.loads(_native.measure(_input.take(vertices, faces, face_sizes), surface, float(gap)))


def render(meshes, path, /, *, captions=None, width=1600, height=1200, views=0, azimuth=35.0, elevation=22.0, wires=True, dots=True,
           labels=True, lines=False, chord=0, follow=None):
    """Writes a picture (PNG) of a mesh, or of up to eight in a list; needs no display. Arguments as of `quadwright render`.

    follow: a surface, for colours by the angle between the edges of quads and its principal directions.
    """
    listed = list(meshes) if isinstance(meshes, list) else [meshes]
    names = list(captions) if captions is not None else [None] * len(listed)
    if len(names) != len(listed):
        raise ValueError(f"captions: {len(names)} for {len(listed)} meshes")
    panels = [(_input.take(mesh, name=f"mesh {i}"), names[i]) for i, mesh in enumerate(listed)]
    surface = None if follow is None else _input.take(follow, name="follow")
    _native.render(panels, path, surface, width, height, views, wires, dots, labels, lines, chord, azimuth, elevation)


def _stamp(path):
    """Size and time of a file; None where it is not there."""
    try:
        told = os.stat(path)
    except OSError:
        return None
    return [told.st_size, told.st_mtime_ns]


def _names_beside(source):
    """Buffers and images that a glTF file names, by paths from its folder."""
    if not _may_be_gltf(source):
        return []
    with open(source, "rb") as file:
        data = file.read()
    if data.startswith(b"glTF"):
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    try:
        told = json.loads(data.decode("utf-8", "surrogateescape"))
        names = [item.get("uri") for kind in ("buffers", "images") for item in told.get(kind, [])]
    except (ValueError, AttributeError, TypeError):
        return []  # load() says what is wrong with it
    names = [urllib.parse.unquote(name, errors="surrogateescape") for name in names if isinstance(name, str) and not name.startswith("data:")]
    return [name for name in names if "\0" not in name]


def _statements(path, words, most):
    """What follows one of the words in lines of a file."""
    try:
        with open(path, "rb") as file:
            lines = file.read(most).splitlines()
    except OSError:
        return []
    pairs = [line.strip().split(None, 1) for line in lines]
    return [os.fsdecode(p[1]).replace("\\", "/") for p in pairs if len(p) == 2 and p[0].lower().startswith(words) and b"\0" not in p[1]]


def _names_of_materials(source, libraries):
    """MTL files of an OBJ, and textures that these name, by paths from its folder; of a statement with options all that may be the name."""
    names = list(libraries)
    for library in libraries:
        for rest in _statements(os.path.join(os.path.dirname(source), library), (b"map_", b"norm", b"bump", b"disp"), 1 << 24):
            names += [rest[at.start() :] for at in re.finditer(r"\S+", rest)]
    return names


def _stamps_of(source, has_maps):
    """{name: stamp} of the files that a model names beside itself; with maps also of its materials, which these are baked from."""
    names = _names_beside(source)
    if has_maps and source.lower().endswith(".obj"):
        names += _names_of_materials(source, _statements(source, (b"mtllib",), 1 << 16))
    folder = os.path.dirname(os.path.abspath(source))
    return {ascii(name): _stamp(os.path.join(folder, name)) for name in names}


def _result_of_file(source, target, options, read=load):
    """Remeshes a file into another: its record, which lies beside the target and is not made again."""
    record = target + ".record.json"
    key = [__version__, sorted((k, repr(v)) for k, v in options.items() if k not in ("threads", "progress", "time_limit")), _stamp(source), _stamps_of(source, options.get("bake"))]
    key = json.loads(json.dumps(key))
    try:
        with open(record) as file:
            known = json.load(file)
        if known["key"] == key and os.path.getsize(target) == known["output_bytes"]:
            return known
    except (OSError, ValueError, KeyError):
        pass
    result = remesh(read(source), **options)
    result.save(target)
    told = {"input": source, "output": target, "status": "OK", "message": "", "key": key, "output_bytes": os.path.getsize(target),
            "process": os.getpid(), "report": result.report}
    beside = f"{record}.{os.getpid()}.part"
    with open(beside, "w") as file:
        json.dump(told, file)
    os.replace(beside, record)
    return told


__all__ = ["Attribute", "CANCEL", "Error", "Guide", "Mesh", "Provenance", "Remesher", "Result", "asset", "load", "load_memory", "measure", "options", "presets", "remesh", "render", "save", "save_levels"]
__all__ += [error.__name__ for error in _errors if error is not Error]
__all__ += ["TimeLimitError"]


def __dir__():
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
