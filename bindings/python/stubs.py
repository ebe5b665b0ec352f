"""stubs.py EXTENSION FOLDER: writes __init__.pyi and dask.pyi from the tables of the library, which the extension lists. Needs no NumPy."""
import importlib.machinery
import importlib.util
import pathlib
import sys

HEAD = '''# Made by stubs.py from the library's tables.
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

__version__: str
_Path = str | bytes | os.PathLike[str]
_Progress = bool | Callable[[str, float], object] | None
_Domain = Literal["vertex", "corner", "face"]
_Kind = Literal["values", "normals", "uvs", "weights", "labels"]

'''
REST = '''
class Attribute:
    values: Any
    per: _Domain | None
    kind: _Kind | None
    groups: Any
    names: Sequence[str] | None
    storage: str | None
    name: str | None
    def __init__(self, values: npt.ArrayLike, per: _Domain | None = ..., kind: _Kind | None = ..., *, groups: npt.ArrayLike | None = ...,
                 names: Sequence[str] | None = ..., storage: str | None = ..., name: str | None = ...) -> None: ...
    def __array__(self, dtype: Any = ..., copy: bool | None = ...) -> npt.NDArray[Any]: ...
    def __len__(self) -> int: ...

class Guide:
    points: Any
    kind: Literal["loop", "direction"]
    closed: bool
    rings: int
    def __init__(self, points: npt.ArrayLike, kind: Literal["loop", "direction"] = ..., closed: bool = ..., rings: int = ...) -> None: ...

class Provenance:
    vertices: npt.NDArray[np.void]
    corners: npt.NDArray[np.void]
    lost_vertices: int
    lost_corners: int
    farthest: float

class Mesh:
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    face_sizes: npt.NDArray[np.int32] | None
    marked_edges: npt.NDArray[np.int32] | None
    attributes: dict[str, Attribute]
    library: str | None
    scene: Any
    def __init__(self, vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32], face_sizes: npt.NDArray[np.int32] | None = ...,
                 marked_edges: npt.NDArray[np.int32] | None = ..., attributes: dict[str, Attribute] = ..., library: str | None = ...,
                 scene: Any = ...) -> None: ...
    def save(self, path: _Path, format: str = ...) -> None: ...
    def to_trimesh(self) -> Any: ...
    def to_meshio(self) -> Any: ...
    def to_vtk(self) -> Any: ...
    def to_pyvista(self) -> Any: ...
    def to_open3d(self) -> Any: ...
    def _repr_html_(self) -> str: ...

class Result:
    vertices: npt.NDArray[np.float64]
    quads: npt.NDArray[np.int32]
    report: dict[str, Any]
    asset: dict[str, Any] | None
    maps: dict[str, npt.NDArray[Any]]
    attributes: dict[str, Attribute]
    transfer: dict[str, int] | None
    provenance: Provenance | None
    field: npt.NDArray[np.float32] | None
    coarse: tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]] | None
    library: str | None
    scene: Any
    faces: npt.NDArray[np.int32]
    face_sizes: npt.NDArray[np.int32] | None
    def measure(self, against: Any = ...) -> Measures: ...
    def save(self, path: _Path, format: str = ...) -> None: ...
    def to_trimesh(self) -> Any: ...
    def to_meshio(self) -> Any: ...
    def to_vtk(self) -> Any: ...
    def to_pyvista(self) -> Any: ...
    def to_open3d(self) -> Any: ...
    def _repr_html_(self) -> str: ...

class Remesher:
    def __init__(self, vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
                 {surface}, memory_limit: int | str = ...) -> None: ...
    def set_region(self, region: npt.ArrayLike | None) -> None: ...
    def set_density(self, density: npt.ArrayLike | None) -> None: ...
    def set_guides(self, guides: _Guides | None) -> None: ...
    def set_field(self, field: _Field | None) -> None: ...
    def remesh(self, *, {run},{options}) -> Result: ...
    def levels(self, faces: Iterable[int], **options: Any) -> list[Result]: ...
    def save_patches(self, path: _Path, patches_from: Literal["quads", "blocks"] = ...) -> None: ...

def remesh(points: Any, triangles: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
           {surface}, memory_limit: int | str = ...,
           {run},{options}) -> Result: ...
def asset(points: Any, triangles: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
           {surface}, memory_limit: int | str = ...,
           {run},{options}) -> Result: ...
CANCEL: str
def options() -> dict[str, dict[str, Any]]: ...
def presets() -> dict[str, dict[str, Any]]: ...
def load(path: _Path, *more: _Path) -> Mesh: ...
def load_memory(data: Any) -> Mesh: ...
def save(path: _Path, vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
         attributes: Mapping[str, npt.ArrayLike | Attribute] | None = ..., format: str = ...) -> None: ...
def save_levels(path: _Path, levels: Sequence[Result | Mesh], *, format: str = ...) -> None: ...
def measure(vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
            against: Any = ..., gap: float = ...) -> Measures: ...
def render(meshes: Any, path: _Path, /, *, captions: Sequence[str | None] | None = ..., width: int = ..., height: int = ..., views: int = ...,
           azimuth: float = ..., elevation: float = ..., wires: bool = ..., dots: bool = ..., labels: bool = ..., lines: bool = ...,
           chord: int = ..., follow: Any = ...) -> None: ...
'''
# Arguments of what goes with the surface, and of a run, that are no options of the table.
SURFACE = """marked_edges: npt.ArrayLike | None = ..., attributes: Mapping[str, npt.ArrayLike | Attribute] | None = ...,
           keep: str | Sequence[str] | None = ..., density: npt.ArrayLike | None = ..., guides: _Guides | None = ..., field: _Field | None = ...,
           region: npt.ArrayLike | None = ..."""
RUN = """preset: Literal[{presets}] | None = ..., progress: _Progress = ..., time_limit: float | None = ..., normals: Literal["input", "none", "smooth", "split"] = ..., provenance: bool = ..., field_per: Literal["vertex", "face"] | None = ..., most_weights: int = ..., unwrap: bool = ..., bake: str | Sequence[str] | None = ..."""
ALIASES = """
_Guides = _Path | Sequence[npt.ArrayLike | Guide]
_Field = _Path | npt.ArrayLike | Attribute
"""
DASK = '''# Made by stubs.py from the library's tables.
import os
from collections.abc import Sequence
from typing import Any, Literal

def remesh_many(paths: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str], /, *, client: Any, retries: int = ..., format: str = ..., preset: Literal[{presets}] | None = ..., time_limit: float | None = ..., unwrap: bool = ..., bake: str | Sequence[str] | None = ...,{options}
                ) -> list[dict[str, Any]]: ...
'''
TYPES = {"count": "int | float | None", "real": "float | None", "flag": "bool | None"}
MEASURES = (1, 2)  # qw_record


def option_line(row):
    name, kind, choices = row[0], row[1], row[6]
    type_ = TYPES.get(kind) or "Literal[" + ", ".join(f'"{c}"' for c in choices.split("|")) + "] | None"
    if name == "symmetry":
        type_ = type_.replace(" | None", " | Sequence[float] | None")
    if name == "wrap":
        type_ = "bool | float | str | None"
    return f"\n           {name}: {type_} = ..."


def main(extension, folder):
    loader = importlib.machinery.ExtensionFileLoader("quadwright._native", extension)
    native = importlib.util.module_from_spec(importlib.util.spec_from_loader("quadwright._native", loader))
    text = HEAD + "class Measures(TypedDict):\n"
    for record in MEASURES:
        for name, type_, optional, unit, help_ in native.fields(record):
            text += f"    {name}: {type_}{' | None' if optional else ''}  # {unit}: {help_}\n"
    text += "    valence: dict[str, int]\n\nclass Error(Exception):\n    status: str\n    exit_code: int\n"
    for name, _, _ in native.statuses():
        title = "".join(word.capitalize() for word in name.split("_"))
        if name != "OK":
            class_name = {"CANCELLED": "Cancelled", "MEMORY": "OutOfMemoryError"}.get(name, title + "Error")
            text += f"class {class_name}(Error): ...\n"
    text += "class TimeLimitError(Cancelled, TimeoutError): ...\n"
    options = ",".join(option_line(row) for row in [*native.options(), *native.asset_options()])
    presets = ", ".join(f'"{row[0]}"' for row in native.presets())
    text += ALIASES + REST.replace("{surface}", SURFACE).replace("{run}", RUN).replace("{presets}", presets).replace("{options}", options)
    (pathlib.Path(folder) / "__init__.pyi").write_text(text)
    (pathlib.Path(folder) / "dask.pyi").write_text(DASK.replace("{presets}", presets).replace("{options}", options))


main(*sys.argv[1:])
