"""stubs.py EXTENSION OUT: writes __init__.pyi from the tables of the library, which the extension lists. Needs no NumPy."""
import importlib.machinery
import importlib.util
import sys

HEAD = '''# Made by stubs.py from the library's tables.
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

__version__: str
_Path = str | bytes | os.PathLike[str]
_Progress = bool | Callable[[str, float], object] | None

'''
REST = '''
class Mesh:
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    face_sizes: npt.NDArray[np.int32] | None
    marked_edges: npt.NDArray[np.int32] | None
    def __init__(self, vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32], face_sizes: npt.NDArray[np.int32] | None = ...,
                 marked_edges: npt.NDArray[np.int32] | None = ...) -> None: ...
    def save(self, path: _Path, format: str = ...) -> None: ...
    def to_trimesh(self) -> Any: ...
    def to_meshio(self) -> Any: ...
    def _repr_html_(self) -> str: ...

class Result:
    vertices: npt.NDArray[np.float64]
    quads: npt.NDArray[np.int32]
    report: Mapping[str, Any]
    @property
    def faces(self) -> npt.NDArray[np.int32]: ...
    def measure(self, against: Any = ...) -> Measures: ...
    def save(self, path: _Path, format: str = ...) -> None: ...
    def to_trimesh(self) -> Any: ...
    def to_meshio(self) -> Any: ...
    def _repr_html_(self) -> str: ...

class Remesher:
    def __init__(self, vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
                 marked_edges: npt.ArrayLike | None = ..., memory_limit: int = ...) -> None: ...
    def remesh(self, *, progress: _Progress = ...,{options}) -> Result: ...

def remesh(vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
           marked_edges: npt.ArrayLike | None = ..., progress: _Progress = ..., memory_limit: int = ...,{options}) -> Result: ...
def options() -> dict[str, dict[str, Any]]: ...
def load(path: _Path) -> Mesh: ...
def save(path: _Path, vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
         format: str = ...) -> None: ...
def measure(vertices: Any, faces: npt.ArrayLike | None = ..., /, *, face_sizes: npt.ArrayLike | None = ...,
            against: Any = ...) -> Measures: ...
def render(meshes: Any, path: _Path, /, *, captions: Sequence[str | None] | None = ..., width: int = ..., height: int = ..., views: int = ...,
           azimuth: float = ..., elevation: float = ..., wires: bool = ..., dots: bool = ..., labels: bool = ..., lines: bool = ...,
           chord: int = ..., follow: Any = ...) -> None: ...
'''
TYPES = {"count": "int | None", "real": "float | None", "flag": "bool | None"}
MEASURES = (1, 2)  # qw_record


def option_line(row):
    name, kind, choices = row[0], row[1], row[6]
    name = {"faces": "faces_wanted", "vertices": "vertices_wanted"}.get(name, name)
    type_ = TYPES.get(kind) or "Literal[" + ", ".join(f'"{c}"' for c in choices.split("|")) + "] | None"
    return f"\n           {name}: {type_} = ..."


def main(extension, out):
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
    text += REST.replace("{options}", ",".join(option_line(row) for row in native.options()))
    with open(out, "w") as file:
        file.write(text)


main(*sys.argv[1:])
