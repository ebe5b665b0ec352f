"""A mesh is taken as other nodes have it: a dictionary or an object with `vertices` and `faces`, arrays or tensors, with or without ComfyUI's leading dimension of a batch;
a trimesh.Trimesh or a Scene of them; a Mesh or Result of quadwright; or the name of a file."""
import os

import numpy as np
import quadwright

CATEGORY = "3d/quadwright"


class Any(str):
    """A type of a socket that fits all others."""

    def __ne__(self, other):
        return False


def _array(value):
    """An array of a tensor of any package, without importing it."""
    for step in ("detach", "cpu", "numpy"):
        value = getattr(value, step, lambda found=value: found)()
    return np.asarray(value)


def _one(value, name):
    """Without the dimension of a batch, of which only the first is taken."""
    array = _array(value)
    if array.ndim == 3:
        if len(array) != 1:
            raise ValueError(f"{name}: a batch of {len(array)} meshes; give one at a time")
        array = array[0]
    return array


def surface_of(mesh):
    """What quadwright.remesh takes: its positional arguments."""
    if isinstance(mesh, (str, os.PathLike)):
        return (quadwright.load(mesh),)
    if isinstance(mesh, (quadwright.Mesh, quadwright.Result)):
        return (mesh,)
    if hasattr(mesh, "geometry") and hasattr(mesh, "graph"):  # a trimesh.Scene
        mesh = mesh.to_mesh() if hasattr(mesh, "to_mesh") else mesh.dump(concatenate=True)
    if hasattr(mesh, "visual") and hasattr(mesh, "faces"):  # a trimesh.Trimesh, with its colours and texture coordinates
        return (mesh,)
    vertices, faces = (mesh["vertices"], mesh["faces"]) if isinstance(mesh, dict) else (mesh.vertices, mesh.faces)
    return _one(vertices, "vertices"), _one(faces, "faces")


def _more(text):
    """{"unwrap": True} of "unwrap=on": options by name, as at the command line."""
    given, table = {}, quadwright.options()
    for word in text.split():
        name, _, value = word.partition("=")
        name = name.replace("-", "_")
        if name not in table:
            raise ValueError(f"options: quadwright has no option {name!r}")
        kind = table[name]["kind"]
        given[name] = value in ("", "on", "true") if kind == "flag" else value if kind == "choice" else int(value) if kind == "count" else float(value)
    return given


def _triangles_of(result):
    """For nodes that know no quads: a dictionary of the quads as triangles, and the quads beside them."""
    corners = result.faces if result.faces.ndim == 2 else result.quads
    triangles = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3) if corners.shape[1] == 4 else corners
    return {"vertices": result.vertices, "faces": triangles, "quads": result.quads}


def _said(report):
    return f"{report['topology']['quads']} quads, {report['topology']['irregular']} irregular vertices" + "".join(f"\n{line}" for line in report["warnings"])


def _image(maps, name, side):
    """A map as ComfyUI has pictures: a batch of one, RGB from 0 to 1, a tensor where there is torch; black where the asset has no such map."""
    array = np.asarray(maps.get(name, np.zeros((side, side, 3), np.uint8)))
    array = (array.reshape(*array.shape[:2], -1) / np.float32(np.iinfo(array.dtype).max)).astype(np.float32)[None, :, :, :3]
    try:
        import torch
    except ImportError:
        return array
    return torch.from_numpy(array)


class Remesh:
    """Quads of a mesh."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    RETURN_TYPES = ("QUADS", "MESH", "STRING")
    RETURN_NAMES = ("quads", "mesh", "report")
    DESCRIPTION = "Makes a clean all-quad mesh of any triangle surface. `mesh` is a dictionary of the quads as triangles, for nodes that know no quads."

    @classmethod
    def INPUT_TYPES(cls):
        symmetries = quadwright.options()["symmetry"]["choices"]
        return {
            "required": {
                "mesh": (Any("*"),),
                "faces": ("INT", {"default": 5000, "min": 1, "max": 20000000}),
                "preset": (["none", *quadwright.presets()],),
                "symmetry": (["preset", *(s for s in symmetries if s != "plane")],),
            },
            "optional": {
                "keep": ("STRING", {"default": "", "tooltip": "seams,materials: borders that edges of the quads follow"}),
                "options": ("STRING", {"default": "", "tooltip": "more options by name, as in: adaptive=0.75 loops=1"}),
            },
        }

    def run(self, mesh, faces, preset="none", symmetry="preset", keep="", options=""):
        given = _more(options)
        if symmetry != "preset":
            given["symmetry"] = symmetry
        result = quadwright.remesh(*surface_of(mesh), faces=faces, preset=None if preset == "none" else preset, keep=keep or None, **given)
        return result, _triangles_of(result), _said(result.report)


class Asset:
    """Quads of a mesh with texture coordinates of their own, and maps on them of what the mesh looks like."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    RETURN_TYPES = ("QUADS", "MESH", "IMAGE", "IMAGE", "STRING")
    RETURN_NAMES = ("quads", "mesh", "color", "normal", "report")
    DESCRIPTION = "Makes quads of any triangle surface and bakes its colours, textures and normals onto them. Save Quads writes a GLB with the maps inside."

    @classmethod
    def INPUT_TYPES(cls):
        inputs = Remesh.INPUT_TYPES()
        inputs["required"]["texture"] = ("INT", {"default": 2048, "min": 16, "max": 16384})
        return inputs

    def run(self, mesh, faces, preset="none", symmetry="preset", texture=2048, keep="", options=""):
        given = _more(options)
        if symmetry != "preset":
            given["symmetry"] = symmetry
        preset = None if preset == "none" else preset
        result = quadwright.asset(*surface_of(mesh), faces=faces, texture=texture, preset=preset, keep=keep or None, **given)
        told = f"{_said(result.report)}\n{result.asset['charts']} charts, normals {result.asset['normal_error']:.1f} degrees off"
        return result, _triangles_of(result), _image(result.maps, "color", texture), _image(result.maps, "normal", texture), told


class Save:
    """Quads, or any mesh, as a file in ComfyUI's folder for output."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    OUTPUT_NODE = True
    RETURN_TYPES = ("STRING",)
    RETURN_NAMES = ("path",)

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "quads": (Any("*"),),
                "filename_prefix": ("STRING", {"default": "quads"}),
                "format": (["glb", "obj", "ply", "off", "gltf"],),
            }
        }

    def run(self, quads, filename_prefix, format):
        folder = _output_folder()
        stem = os.path.normpath(filename_prefix)
        if os.path.isabs(stem) or stem.split(os.sep)[0] == "..":
            raise ValueError(f"filename_prefix: {filename_prefix!r} leads out of the folder for output")
        os.makedirs(os.path.dirname(os.path.join(folder, stem)), exist_ok=True)
        number = 1
        while os.path.exists(path := os.path.join(folder, f"{stem}_{number:05}.{format}")):
            number += 1
        surface = surface_of(quads)
        surface[0].save(path) if hasattr(surface[0], "save") else quadwright.save(path, *surface)
        return {"ui": {"text": [path]}, "result": (path,)}


def _output_folder():
    try:
        import folder_paths  # of ComfyUI
    except ImportError:
        return os.getcwd()
    return folder_paths.get_output_directory()


NODE_CLASS_MAPPINGS = {"QuadwrightRemesh": Remesh, "QuadwrightAsset": Asset, "QuadwrightSave": Save}
NODE_DISPLAY_NAME_MAPPINGS = {"QuadwrightRemesh": "Remesh to Quads", "QuadwrightAsset": "Make an Asset of Quads", "QuadwrightSave": "Save Quads"}
