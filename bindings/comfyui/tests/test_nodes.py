"""The nodes as ComfyUI calls them, with torch, and with stand-ins that have the names of ComfyUI's own modules and do what these are known to do."""
import importlib.util
import io
import json
import os
import pathlib
import struct
import sys
import tomllib
import types

import numpy as np
import pytest
import quadwright
import torch

FOLDER = pathlib.Path(__file__).resolve().parent.parent


class Interrupted(Exception):
    """Of comfy.model_management."""


@pytest.fixture
def host(tmp_path, monkeypatch):
    """ComfyUI: its folders, its bar, its button."""
    folders = {name: tmp_path / name for name in ("input", "output")}
    for folder in folders.values():
        folder.mkdir()

    def get_save_image_path(prefix, output):
        subfolder, stem = os.path.dirname(os.path.normpath(prefix)), os.path.basename(os.path.normpath(prefix))
        full = os.path.join(output, subfolder)
        if os.path.commonpath((output, os.path.abspath(full))) != output:
            raise Exception("saving outside the output folder is not allowed")
        os.makedirs(full, exist_ok=True)
        taken = [int(name[len(stem) + 1 :].split("_")[0]) for name in os.listdir(full) if name.startswith(stem + "_") and name[len(stem) + 1 :].split("_")[0].isdigit()]
        return full, stem, max(taken, default=0) + 1, subfolder, prefix

    state = types.SimpleNamespace(**folders, told=[], is_interrupted=False)

    def throw():
        if state.is_interrupted:
            raise Interrupted()

    class ProgressBar:
        def __init__(self, total):
            assert total == 100

        def update_absolute(self, value, total=None):
            state.told.append(value)

    modules = {"folder_paths": {"get_save_image_path": get_save_image_path, "get_output_directory": lambda: str(folders["output"]),
                                "get_annotated_filepath": lambda name: os.path.join(folders["input"], name)},
               "comfy": {}, "comfy.utils": {"ProgressBar": ProgressBar}, "comfy.model_management": {"throw_exception_if_processing_interrupted": throw}}
    for name, members in modules.items():
        module = types.ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    for name in ("utils", "model_management"):
        setattr(sys.modules["comfy"], name, sys.modules[f"comfy.{name}"])
    return state


@pytest.fixture(scope="module")
def nodes():
    spec = importlib.util.spec_from_file_location("quadwright_comfyui", FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)])
    sys.modules["quadwright_comfyui"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.NODE_CLASS_MAPPINGS


@pytest.fixture(scope="module")
def cube():
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    faces = np.array([[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]])
    return corners, faces


def core_mesh(points, faces, **more):
    """What core's nodes hand out: only what MESH of every version has."""
    return types.SimpleNamespace(vertices=torch.tensor(points, dtype=torch.float32)[None], faces=torch.tensor(faces)[None], **more)


def core_saves(mesh, index=0):
    """The bytes of a GLB, read from a MESH as SaveGLB of core does: every attribute that it asks for, as tensors with the dimension of the batch."""
    item = {}
    for name, width in (("vertices", 3), ("faces", 3), ("uvs", 2), ("vertex_colors", None)):
        tensor = getattr(mesh, name)
        if tensor is not None:
            assert isinstance(tensor, torch.Tensor) and tensor.ndim == 3 and (width is None or tensor.shape[-1] == width), name
            count = mesh.vertex_counts if name != "faces" else mesh.face_counts
            item[name] = (tensor[index] if count is None else tensor[index, : int(count[index].item())]).cpu().numpy()
    assert index < mesh.vertices.shape[0] and 0 <= item["faces"].min() and item["faces"].max() < len(item["vertices"])
    for name in ("texture", "normal_map", "metallic_roughness", "emissive"):
        tensor = getattr(mesh, name)
        assert tensor is None or (tensor.ndim == 4 and tensor.shape[-1] == 3 and 0 <= float(tensor.min()) and float(tensor.max()) <= 1), name
    assert not mesh.unlit and not mesh.occlusion_in_mr and mesh.tangents is None and mesh.normals is None and mesh.material is None
    arrays = [("POSITION", item["vertices"].astype("<f4"), 5126, "VEC3"), ("TEXCOORD_0", item.get("uvs"), 5126, "VEC2"),
              ("COLOR_0", item.get("vertex_colors"), 5126, f"VEC{item['vertex_colors'].shape[1]}" if "vertex_colors" in item else ""),
              (None, item["faces"].astype("<u4").reshape(-1), 5125, "SCALAR")]
    views, accessors, primitive, data = [], [], {"attributes": {}, "mode": 4}, b""
    for name, array, kind, type_ in arrays:
        if array is None:
            continue
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessor = {"bufferView": len(views) - 1, "componentType": kind, "count": len(array), "type": type_}
        if name == "POSITION":
            accessor.update(min=array.min(axis=0).tolist(), max=array.max(axis=0).tolist())
        primitive.update({"indices": len(accessors)}) if name is None else primitive["attributes"].update({name: len(accessors)})
        accessors.append(accessor)
        data += array.tobytes()
    document = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(data)}], "bufferViews": views, "accessors": accessors,
                           "meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}).encode()
    document += b" " * (-len(document) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 28 + len(document) + len(data), len(document), 0x4E4F534A) + document + struct.pack("<II", len(data), 0x004E4942) + data


def test_inputs_are_what_comfyui_asks_for(nodes):
    for node in nodes.values():
        inputs = node.INPUT_TYPES()
        assert all(isinstance(row, tuple) for kind in inputs.values() for row in kind.values())
        assert callable(getattr(node, node.FUNCTION)) and len(node.RETURN_TYPES) == len(node.RETURN_NAMES)


class File3D:
    """Of comfy_api: a file, or the bytes of one."""

    def __init__(self, source):
        self.source, self.format = source, "glb"

    def get_source(self):
        return self.source


def given(kind, points, faces, host):
    """The cube as a socket has it."""
    if kind == "MESH":
        return core_mesh(points, faces)
    if kind == "padded MESH":  # as a batch of meshes of unlike sizes leaves it
        more = {"vertex_counts": torch.tensor([8]), "face_counts": torch.tensor([12])}
        return core_mesh(np.concatenate([points, np.full((3, 3), 9.0)]), np.concatenate([faces, [[10, 9, 8]]]), **more)
    if kind == "MESH on its way":
        mesh = core_mesh(points, faces)
        mesh.vertices.requires_grad_()
        return mesh
    if kind == "dictionary":
        return {"vertices": points, "faces": faces}
    if kind == "TRIMESH":  # of trimesh nothing else is asked, where it has no pictures
        return types.SimpleNamespace(vertices=points, faces=faces, visual=types.SimpleNamespace(kind=None), export=None)
    (host.input / "3d").mkdir()
    path = host.input / "3d/cube.glb"
    quadwright.save(path, points, faces)
    if kind == "scene of trimesh":
        return types.SimpleNamespace(geometry={}, graph=None, export=lambda file_type: path.read_bytes() if file_type == "glb" else None)
    if kind == "File3D":
        return File3D(str(path))
    if kind == "File3D of bytes":
        return File3D(io.BytesIO(path.read_bytes()))
    return "3d/cube.glb" if kind == "name of Load3D" else str(path)


KINDS = ["MESH", "padded MESH", "MESH on its way", "dictionary", "TRIMESH", "scene of trimesh", "File3D", "File3D of bytes", "name of Load3D", "path"]


@pytest.mark.parametrize("kind", KINDS)
def test_remesh(nodes, cube, host, kind):
    points, faces = cube
    quads, mesh, trimesh, told = nodes["QuadwrightRemesh"]().run(given(kind, points, faces, host), 600, "cad", "preset", "", "loops=0.5")
    path = host.input / "3d/cube.glb"
    surface = (quadwright.load(path),) if path.exists() else (points, faces)
    same = quadwright.remesh(*surface, faces=600, preset="cad", loops=0.5)
    assert np.array_equal(quads.quads, same.quads) and "quads, 8 irregular" in told
    saved = quadwright.load_memory(core_saves(mesh))
    assert saved.faces.shape == (2 * len(quads.quads), 3) and len(saved.vertices) == len(quads.vertices)
    assert np.allclose(saved.vertices, same.vertices, atol=1e-6)
    again = nodes["QuadwrightRemesh"]().run(mesh, 100)[0]  # what a node gives another takes
    assert abs(len(again.quads) - 100) < 40


def test_what_it_is_of_core(nodes, cube, host, monkeypatch):
    """Where core has a MESH of its own, that is handed out."""
    class MESH:
        def __init__(self, vertices, faces, uvs=None, vertex_colors=None, texture=None, normal_map=None):
            self.vertices, self.faces, self.vertex_colors = vertices, faces, vertex_colors

    latest = types.ModuleType("comfy_api.latest")
    latest.Types = types.SimpleNamespace(MESH=MESH)
    monkeypatch.setitem(sys.modules, "comfy_api", types.ModuleType("comfy_api"))
    monkeypatch.setitem(sys.modules, "comfy_api.latest", latest)
    mesh = core_mesh(*cube, vertex_colors=torch.tensor(cube[0], dtype=torch.float32)[None])
    made = nodes["QuadwrightRemesh"]().run(mesh, 100)[1]
    assert type(made) is MESH and np.allclose(made.vertex_colors[0, :, :3], made.vertices[0], atol=0.02)  # red grows with x, and so on


def test_trimesh_out(nodes, cube, host, monkeypatch):
    module = types.ModuleType("trimesh")
    module.Trimesh = lambda vertices, faces, **more: types.SimpleNamespace(vertices=vertices, faces=faces, **more)
    module.load = lambda path, **more: (pathlib.Path(path).read_bytes(), more)
    assert nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 100)[2] is None
    monkeypatch.setitem(sys.modules, "trimesh", module)
    quads, _, trimesh, _ = nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 100)
    assert len(trimesh.faces) == 2 * len(quads.quads) and not trimesh.process
    data, how = nodes["QuadwrightAsset"]().run(core_mesh(*cube), 100, texture=64)[2]
    assert data.startswith(b"glTF") and how == {"force": "mesh", "process": False}


def test_asset(nodes, cube, host):
    """A picture on the cube, red above and green below, comes out on the quads, where it was."""
    points, faces = cube
    picture = torch.zeros(1, 16, 16, 3)
    picture[0, :8, :, 0], picture[0, 8:, :, 1] = 1, 1
    mesh = core_mesh(points, faces, uvs=torch.tensor(points[:, [0, 2]] * [1, -0.8] + [0, 0.9], dtype=torch.float32)[None], texture=picture, vertex_colors=None)
    result, made, _, color, normal, told = nodes["QuadwrightAsset"]().run(mesh, 100, texture=64)
    assert "charts" in told and len(made.faces[0]) == 2 * len(result.quads)
    assert color.shape == normal.shape == (1, 64, 64, 3) and color.dtype == torch.float32 and 0 <= color.min() and color.max() <= 1
    assert torch.equal(made.texture, color) and torch.equal(made.normal_map, normal)
    saved = quadwright.load_memory(core_saves(made))
    uv, corners = saved.attributes["uv"].values, saved.faces.reshape(-1)
    uv = uv if saved.attributes["uv"].per == "corner" else uv[corners]
    middles, places = saved.vertices[saved.faces].mean(axis=1), uv.reshape(-1, 3, 2).mean(axis=1)
    texels = color[0].numpy()[(64 * (1 - places[:, 1])).astype(int), (64 * places[:, 0]).astype(int)]
    clear = abs(middles[:, 2] - 0.5) > 0.15
    assert clear.sum() > 50 and np.array_equal(texels[clear, 0] > 0.5, middles[clear, 2] > 0.5) and np.array_equal(texels[clear, 1] > 0.5, middles[clear, 2] < 0.5)
    shown = nodes["QuadwrightSave"]().run(result, "3d/cube", "glb")
    assert b"normalTexture" in (host.output / shown["result"][0]).read_bytes()
    assert not nodes["QuadwrightAsset"]().run(core_mesh(points, faces), 100, texture=64)[3].any()  # black where there is no picture


def test_options(nodes, cube, host):
    parse = sys.modules["quadwright_comfyui.nodes"].options_of
    for word in ("1", "True", "yes", "on", "TRUE"):
        assert parse(f"exact={word} unwrap={word}") == {"exact": True, "unwrap": True}
    for word in ("0", "False", "no", "off"):
        assert parse(f"exact={word}") == {"exact": False}
    assert parse("--fill-holes=1e3 exact wrap=0.5q symmetry=1,0,0,0; time_limit=60") == {"fill_holes": 1000.0, "exact": True, "wrap": "0.5q", "symmetry": "1,0,0,0", "time_limit": 60.0}
    quads, mesh, _, _ = nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 100, options="unwrap=on exact=yes fill_holes=1e3")
    assert quads.attributes["uv"].kind == "uvs" and mesh.uvs.shape[1] == mesh.vertices.shape[1] and quadwright.load_memory(core_saves(mesh)).attributes["uv"].kind == "uvs"
    for text, says in (("nothing=1", "^options: quadwright has no option 'nothing'"), ("exact=2", "^options: exact must be on or off"), ("exact=perhaps", "on or off"),
                       ("adaptive=much", "^options: adaptive must be a number"), ("flow=none", "^flow: must")):
        with pytest.raises(ValueError, match=says):
            nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 100, options=text)
    with pytest.raises(ValueError, match="^vertices: a batch of 2"):
        nodes["QuadwrightRemesh"]().run({"vertices": np.stack([cube[0]] * 2), "faces": cube[1]}, 100)
    with pytest.raises(TypeError, match="^mesh: a MESH"):
        nodes["QuadwrightRemesh"]().run(3, 100)
    with pytest.raises(FileNotFoundError, match="^mesh: there is no 3d/none.glb in the folders"):
        nodes["QuadwrightRemesh"]().run("3d/none.glb", 100)


def test_progress_and_cancel(nodes, cube, host):
    nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 5000)
    assert len(host.told) >= 2 and host.told == sorted(host.told) and host.told[-1] == 100
    host.told.clear()
    nodes["QuadwrightAsset"]().run(core_mesh(*cube), 5000, texture=256)
    assert host.told == sorted(host.told) and host.told[-1] == 100 and host.told[0] < 34 < host.told[-2] < 100
    host.is_interrupted = True
    with pytest.raises(Interrupted):
        nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 5000)


def test_save(nodes, cube, host):
    quads = nodes["QuadwrightRemesh"]().run(core_mesh(*cube), 100)[0]
    first, second = (nodes["QuadwrightSave"]().run(quads, "made/cube", "obj") for _ in range(2))
    assert first["ui"] == {"3d": [{"filename": "cube_00001_.obj", "subfolder": "made", "type": "output"}]}
    assert first["result"] == ("made/cube_00001_.obj",) and second["result"] == ("made/cube_00002_.obj",)
    saved = quadwright.load(host.output / first["result"][0])
    assert len(saved.faces) == len(quads.quads) and saved.faces.shape[1] == 4
    for mesh in (core_mesh(*cube), {"vertices": cube[0], "faces": cube[1]}, first["result"][0]):
        assert (host.output / nodes["QuadwrightSave"]().run(mesh, "cube", "glb")["result"][0]).exists()
    with pytest.raises(Exception, match="outside"):
        nodes["QuadwrightSave"]().run(quads, "../cube", "obj")


def test_the_folder_is_complete(nodes):
    told = tomllib.loads((FOLDER / "pyproject.toml").read_text())
    assert told["project"]["version"] == quadwright.__version__ and "comfyui" not in told["project"]["name"].lower()
    assert told["tool"]["comfy"].keys() == {"PublisherId", "DisplayName", "Icon"}
    assert (FOLDER / "requirements.txt").read_text().split() == told["project"]["dependencies"] == [f"quadwright=={quadwright.__version__}"]


def test_the_workflow(nodes):
    """Links lead from sockets to sockets of one type, and every widget has a value that it takes."""
    told = json.loads((FOLDER / "example_workflows/scan_to_quads.json").read_text())
    by_id = {node["id"]: node for node in told["nodes"]}
    assert {node["type"] for node in told["nodes"]} >= {"QuadwrightAsset", "QuadwrightSave", "Load3D"}
    for number, origin, slot, target, socket, type_ in told["links"]:
        output, input_ = by_id[origin]["outputs"][slot], by_id[target]["inputs"][socket]
        assert number in output["links"] and input_["link"] == number and output["type"] == type_ and input_["type"] in ("*", type_)
    for node in told["nodes"]:
        ours = nodes.get(node["type"])
        if ours is None:
            continue
        assert [o["type"] for o in node["outputs"]] == list(ours.RETURN_TYPES) and [o["name"] for o in node["outputs"]] == list(ours.RETURN_NAMES)
        inputs = {**ours.INPUT_TYPES()["required"], **ours.INPUT_TYPES().get("optional", {})}
        sockets = [i["name"] for i in node["inputs"]]
        widgets = [row for name, row in inputs.items() if name not in sockets]
        assert set(sockets) <= set(inputs) and len(widgets) == len(node["widgets_values"])
        for row, value in zip(widgets, node["widgets_values"]):
            assert value in row[0] if isinstance(row[0], list) else isinstance(value, {"INT": int, "STRING": str}[row[0]])


def test_the_workflow_runs(nodes, cube, host):
    """Node by node, as ComfyUI does it, with stand-ins for core's own: each takes by its links what the others gave."""
    told = json.loads((FOLDER / "example_workflows/scan_to_quads.json").read_text())
    (host.input / "3d").mkdir()
    quadwright.save(host.input / "3d/scan.glb", *cube, attributes={"color": quadwright.Attribute(cube[0], "vertex", storage="uint8")})
    gave, shown = {}, []
    core = {"Load3D": lambda model_file: (None, None, model_file), "Preview3D": lambda model_file: shown.append(host.output / model_file), "PreviewImage": lambda images: shown.append(images)}
    for node in sorted(told["nodes"], key=lambda node: node["order"]):
        taken = {i["name"]: gave[origin][slot] for i in node["inputs"] for number, origin, slot, *_ in told["links"] if number == i["link"]}
        ours = nodes.get(node["type"])
        if ours is None:
            gave[node["id"]] = core[node["type"]](**(taken or {"model_file": node["widgets_values"][0]}))
            continue
        inputs = {**ours.INPUT_TYPES()["required"], **ours.INPUT_TYPES().get("optional", {})}
        widgets = dict(zip([name for name in inputs if name not in taken], node["widgets_values"]))
        quick = {name: value for name, value in {"faces": 600, "texture": 128}.items() if name in widgets}
        result = getattr(ours(), ours.FUNCTION)(**taken, **{**widgets, **quick})
        gave[node["id"]] = result["result"] if isinstance(result, dict) else result
    picture, file = sorted(shown, key=lambda one: isinstance(one, pathlib.Path))
    assert picture.shape == (1, 128, 128, 3) and picture.max() > 0.9
    assert abs(len(quadwright.load(file).faces) - 600) < 60 and b"baseColorTexture" in file.read_bytes()
