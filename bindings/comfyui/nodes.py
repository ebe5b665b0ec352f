"""A surface is taken as other nodes have it: ComfyUI's MESH (an object with `vertices` and `faces`, tensors [1, n, 3]); TRIMESH (a trimesh.Trimesh or a Scene of them); a
File3D, or the name of a file in the folder for input, as Load3D gives it; a dictionary of arrays; or QUADS, a Result of quadwright. Out come all that other nodes take."""
import os
import tempfile

import numpy as np
import quadwright

CATEGORY = "3d/quadwright"


class Any(str):
    """A type of a socket that fits all others."""

    def __ne__(self, other):
        return False


# ---------------------------------------------------------------------------------------------------------------------------- surfaces in


def _array(value):
    """An array of a tensor of any package, without importing it."""
    for step in ("detach", "cpu", "numpy"):
        value = getattr(value, step, lambda found=value: found)()
    return np.asarray(value)


def _one(mesh, name, counts=None):
    """What the mesh has by that name, without the dimension of a batch, of which there is one; None where it has none."""
    value = mesh.get(name) if isinstance(mesh, dict) else getattr(mesh, name, None)
    if value is None:
        return None
    if isinstance(value, (list, tuple)) and hasattr(value[0], "shape") and len(value[0].shape) == 2:
        array = _array(value[0])[None] if len(value) == 1 else np.empty((len(value), 0, 0))
    else:
        array = _array(value)
    if array.ndim == (4 if name == "texture" else 3):
        if len(array) != 1:
            raise ValueError(f"{name}: a batch of {len(array)} meshes; give one at a time")
        array = array[0]
    count = getattr(mesh, counts, None) if counts else None
    return array if count is None else array[: int(_array(count).reshape(-1)[0])]  # a batch of meshes is padded to one length


def _file(name):
    """The path of a file: as Load3D names it, below the folder for input, or as Save Quads does, below that for output."""
    import folder_paths

    for found in (name, folder_paths.get_annotated_filepath(name), os.path.join(folder_paths.get_output_directory(), name)):
        if os.path.isabs(found) and os.path.exists(found):
            return found
    raise FileNotFoundError(f"mesh: there is no {name} in the folders for input and output")


def _own(mesh, vertices, faces):
    """Colours and texture coordinates of a MESH, which has them by vertices; v grows downward there."""
    own, uv, color = {}, _one(mesh, "uvs", "vertex_counts"), _one(mesh, "vertex_colors", "vertex_counts")
    if uv is not None and len(uv) == vertices:
        own["uv"] = quadwright.Attribute(np.stack([uv[:, 0], 1 - uv[:, 1]], -1)[faces.reshape(-1)].astype(np.float32), "corner")
    if color is not None and len(color) == vertices:
        own["color"] = quadwright.Attribute(color.astype(np.float32), "vertex")
    return own


def _made_with_picture(make, surface, texture, given):
    """Of the surface with its picture, as files have them: what maps are baked from."""
    from PIL import Image  # ComfyUI has it

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "surface.obj")
        material = quadwright.Attribute(np.zeros(len(surface.faces), np.int32), "face", names=["picture"])
        quadwright.save(path, surface.vertices, surface.faces, attributes={**surface.attributes, "material": material})
        with open(path) as file:
            text = file.read()
        with open(path, "w") as file:
            file.write("mtllib surface.mtl\n" + text)
        with open(os.path.join(folder, "surface.mtl"), "w") as file:
            file.write("newmtl picture\nKd 1 1 1\nmap_Kd picture.png\n")
        Image.fromarray((np.clip(texture, 0, 1) * 255 + 0.5).astype(np.uint8)[:, :, :3]).save(os.path.join(folder, "picture.png"))
        return make(quadwright.load(path), **given)


def surface_of(mesh):
    """What quadwright.remesh takes: a mesh of quadwright or trimesh, with what it looks like; and of others a Mesh of their arrays."""
    if isinstance(mesh, (str, os.PathLike)):
        return quadwright.load(_file(os.fspath(mesh)))
    if isinstance(mesh, (quadwright.Mesh, quadwright.Result)):
        return mesh
    if hasattr(mesh, "get_source"):  # a File3D
        source = mesh.get_source()
        return quadwright.load(source) if isinstance(source, str) else quadwright.load_memory(source.read())
    if hasattr(mesh, "geometry") or getattr(getattr(mesh, "visual", None), "kind", None) == "texture":  # a trimesh.Scene, or a Trimesh with materials and pictures
        return quadwright.load_memory(mesh.export(file_type="glb"))
    if hasattr(mesh, "visual"):
        return mesh
    vertices, faces = _one(mesh, "vertices", "vertex_counts"), _one(mesh, "faces", "face_counts")
    if vertices is None or faces is None:
        raise TypeError(f"mesh: a MESH, a TRIMESH, a file or QUADS is needed, not {type(mesh).__name__}")
    return quadwright.Mesh(vertices, faces, attributes=_own(mesh, len(vertices), faces))


def run(make, mesh, **given):
    """Makes quads of what a socket has. Tells ComfyUI how far it is, and hears whether it is still wanted."""
    surface, texture = surface_of(mesh), _one(mesh, "texture") if hasattr(mesh, "uvs") else None
    import comfy.utils

    bar = comfy.utils.ProgressBar(100)
    given = {**given, "progress": _teller(bar, 3 if make is quadwright.asset else 1)}
    if texture is None or make is not quadwright.asset or "uv" not in surface.attributes:
        result = make(surface, **given)
    else:
        result = _made_with_picture(make, surface, texture, given)
    bar.update_absolute(100, 100)
    return result


def _teller(bar, pieces):
    """pieces: an asset is a run, then its charts, then its maps, each from 0 on."""
    import comfy.model_management

    done, last = 0, 0.0

    def tell(stage, fraction):
        nonlocal done, last
        comfy.model_management.throw_exception_if_processing_interrupted()
        done, last = done + (fraction < last), fraction
        bar.update_absolute(int(100 * min(done + fraction, pieces) / pieces), 100)

    return tell


# -------------------------------------------------------------------------------------------------------------------------------- options

_YES, _NO = ("", "1", "on", "true", "yes"), ("0", "off", "false", "no")
_ARGUMENTS = {"unwrap": "flag", "time_limit": "real", "memory_limit": "text", "normals": "text", "region": "text"}  # of remesh(), beside the table


def options_of(text):
    """{"unwrap": True} of "unwrap=on": options by name, as at the command line."""
    given, table = {}, quadwright.options()
    for word in text.replace(";", " ").split():
        name, _, value = word.partition("=")
        name = name.lstrip("-").replace("-", "_")
        kind = _ARGUMENTS.get(name) or table.get(name, {}).get("kind")
        if kind is None:
            raise ValueError(f"options: quadwright has no option {name!r}; there are {', '.join([*_ARGUMENTS, *table])}")
        if kind == "flag" and value.lower() in (*_YES, *_NO):
            given[name] = value.lower() in _YES
        elif kind in ("choice", "text") or name == "wrap":
            given[name] = value
        else:
            try:
                given[name] = float(value)
            except ValueError:
                raise ValueError(f"options: {name} must be {'on or off' if kind == 'flag' else 'a number'}, not {value!r}") from None
            if kind == "flag":
                raise ValueError(f"options: {name} must be on or off, not {value!r}")
    return given


def _given(faces, preset, symmetry, keep, options):
    given = {"faces": faces, "preset": None if preset == "none" else preset, "keep": keep or None, **options_of(options)}
    if symmetry != "preset":
        given["symmetry"] = symmetry
    return given


# --------------------------------------------------------------------------------------------------------------------------- surfaces out


class OwnMesh:
    """What ComfyUI's MESH is, where its core is too old to have one: the same names."""

    def __init__(self, vertices, faces, uvs=None, vertex_colors=None, texture=None, normal_map=None):
        self.vertices, self.faces, self.uvs, self.vertex_colors, self.texture, self.normal_map = vertices, faces, uvs, vertex_colors, texture, normal_map
        self.metallic_roughness = self.vertex_counts = self.face_counts = self.normals = self.tangents = self.material = self.emissive = None
        self.unlit = self.occlusion_in_mr = False


def mesh_of(result):
    """The quads as triangles, as ComfyUI's MESH: with their colours, and with texture coordinates and maps of an asset."""
    import torch

    vertices, faces = result.vertices, result._triangles()
    more, uv, color = {}, result.attributes.get("uv"), result.attributes.get("color")
    if uv is not None and uv.per == "corner":  # a vertex for each pair of a vertex and its place in the texture
        corners = np.column_stack([result.faces.reshape(-1), uv.values[:, :2]])
        unique, of = np.unique(corners, axis=0, return_inverse=True)
        faces, first = quadwright.Mesh(vertices, of.reshape(result.faces.shape), result.face_sizes)._triangles(), unique[:, 0].astype(np.int64)
        vertices, more["uvs"] = vertices[first], torch.from_numpy(np.stack([unique[:, 1], 1 - unique[:, 2]], -1).astype(np.float32)[None])
    else:
        first = np.arange(len(vertices))
    if color is not None and color.per == "vertex":
        more["vertex_colors"] = torch.from_numpy(np.ascontiguousarray(color.values[first], dtype=np.float32)[None])
    for name, map_ in (("texture", "color"), ("normal_map", "normal")):
        if map_ in getattr(result, "maps", {}):
            more[name] = picture_of(result.maps[map_])
    return _mesh_class()(torch.from_numpy(vertices.astype(np.float32)[None]), torch.from_numpy(faces.astype(np.int64)[None]), **more)


def _mesh_class():
    try:
        from comfy_api.latest import Types
    except ImportError:
        return OwnMesh
    return getattr(Types, "MESH", OwnMesh)


def trimesh_of(result):
    """A trimesh.Trimesh with the maps of an asset; None where trimesh is not installed."""
    try:
        import trimesh
    except ImportError:
        return None
    if not getattr(result, "maps", None):
        return result.to_trimesh()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "asset.glb")
        result.save(path)
        return trimesh.load(path, force="mesh", process=False)


def picture_of(array):
    """A map as ComfyUI has pictures: a tensor of a batch of one, RGB from 0 to 1."""
    import torch

    pixels = array.reshape(*array.shape[:2], -1)[None, :, :, :3] / np.float32(np.iinfo(array.dtype).max)
    return torch.from_numpy(np.array(pixels, dtype=np.float32))


def _said(report):
    return f"{report['topology']['quads']} quads, {report['topology']['irregular']} irregular vertices" + "".join(f"\n{line}" for line in report["warnings"])


# ---------------------------------------------------------------------------------------------------------------------------------- nodes


class Remesh:
    """Quads of a mesh."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    RETURN_TYPES = ("QUADS", "MESH", "TRIMESH", "STRING")
    RETURN_NAMES = ("quads", "mesh", "trimesh", "report")
    DESCRIPTION = "Makes a clean all-quad mesh of any triangle surface. `mesh` and `trimesh` are the quads as triangles, for nodes that know no quads."

    @classmethod
    def INPUT_TYPES(cls):
        symmetries = quadwright.options()["symmetry"]["choices"]
        return {
            "required": {
                "mesh": (Any("*"), {"tooltip": "MESH, TRIMESH, FILE_3D, QUADS, or the name of a file as Load3D gives it"}),
                "faces": ("INT", {"default": 5000, "min": 1, "max": 20000000}),
                "preset": (["none", *quadwright.presets()],),
                "symmetry": (["preset", *(s for s in symmetries if s != "plane")],),
            },
            "optional": {
                "keep": ("STRING", {"default": "", "tooltip": "seams,materials: borders that edges of the quads follow"}),
                "options": ("STRING", {"default": "", "tooltip": "more options by name, as in: adaptive=0.75 loops=1 unwrap=on"}),
            },
        }

    def run(self, mesh, faces, preset="none", symmetry="preset", keep="", options=""):
        result = run(quadwright.remesh, mesh, **_given(faces, preset, symmetry, keep, options))
        return result, mesh_of(result), trimesh_of(result), _said(result.report)


class Asset:
    """Quads of a mesh with texture coordinates of their own, and maps on them of what the mesh looks like."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    RETURN_TYPES = ("QUADS", "MESH", "TRIMESH", "IMAGE", "IMAGE", "STRING")
    RETURN_NAMES = ("quads", "mesh", "trimesh", "color", "normal", "report")
    DESCRIPTION = "Makes quads of any triangle surface and bakes its colours, textures and normals onto them. Save Quads writes a GLB with the maps inside."

    @classmethod
    def INPUT_TYPES(cls):
        inputs = Remesh.INPUT_TYPES()
        inputs["required"]["texture"] = ("INT", {"default": 2048, "min": 16, "max": 16384})
        return inputs

    def run(self, mesh, faces, preset="none", symmetry="preset", texture=2048, keep="", options=""):
        result = run(quadwright.asset, mesh, texture=texture, **_given(faces, preset, symmetry, keep, options))
        told = f"{_said(result.report)}\n{result.asset['charts']} charts, normals {result.asset['normal_error']:.1f} degrees off"
        black = np.zeros((texture, texture, 3), np.uint8)  # where the surface has no such map
        pictures = [picture_of(result.maps.get(name, black)) for name in ("color", "normal")]
        return result, mesh_of(result), trimesh_of(result), *pictures, told


class Save:
    """Quads, or any mesh, as a file in ComfyUI's folder for output."""

    CATEGORY = CATEGORY
    FUNCTION = "run"
    OUTPUT_NODE = True
    RETURN_TYPES = ("STRING",)
    RETURN_NAMES = ("model_file",)
    DESCRIPTION = "Writes quads into the folder for output. `model_file` is the name below that, as Preview3D takes it."

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "quads": (Any("*"),),
                "filename_prefix": ("STRING", {"default": "3d/quads"}),
                "format": (["glb", "obj", "ply", "off", "stl", "gltf"],),
            }
        }

    def run(self, quads, filename_prefix, format):
        import folder_paths

        folder, stem, counter, subfolder, _ = folder_paths.get_save_image_path(filename_prefix, folder_paths.get_output_directory())
        name = f"{stem}_{counter:05}_.{format}"
        os.makedirs(folder, exist_ok=True)
        surface_of(quads).save(os.path.join(folder, name))
        shown = os.path.join(subfolder, name).replace(os.sep, "/")
        return {"ui": {"3d": [{"filename": name, "subfolder": subfolder, "type": "output"}]}, "result": (shown,)}


NODE_CLASS_MAPPINGS = {"QuadwrightRemesh": Remesh, "QuadwrightAsset": Asset, "QuadwrightSave": Save}
NODE_DISPLAY_NAME_MAPPINGS = {"QuadwrightRemesh": "Remesh to Quads", "QuadwrightAsset": "Make an Asset of Quads", "QuadwrightSave": "Save Quads"}
