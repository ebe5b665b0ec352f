"""The nodes as ComfyUI calls them, without it and without torch."""
import importlib.util
import pathlib
import sys

import numpy as np
import pytest

quadwright = pytest.importorskip("quadwright")
FOLDER = pathlib.Path(__file__).resolve().parent.parent


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


class Tensor:
    """What is asked of a tensor of torch: it gives its array only step by step, as one on a GPU with gradients does."""

    def __init__(self, array):
        self.array = array

    def detach(self):
        return self

    def cpu(self):
        return self

    def numpy(self):
        return self.array


def test_inputs_are_what_comfyui_asks_for(nodes):
    for node in nodes.values():
        inputs = node.INPUT_TYPES()
        assert all(isinstance(row, tuple) for kind in inputs.values() for row in kind.values())
        assert callable(getattr(node, node.FUNCTION)) and len(node.RETURN_TYPES) == len(node.RETURN_NAMES)


@pytest.mark.parametrize("kind", ["dictionary", "object", "batch", "file"])
def test_remesh(nodes, cube, kind, tmp_path):
    points, faces = cube
    mesh = {"vertices": points, "faces": faces}
    if kind == "object":
        mesh = type("Mesh", (), mesh)()
    elif kind == "batch":
        mesh = {"vertices": Tensor(points[None]), "faces": Tensor(faces[None])}
    elif kind == "file":
        quadwright.save(tmp_path / "cube.obj", points, faces)
        mesh = str(tmp_path / "cube.obj")
    quads, triangles, told = nodes["QuadwrightRemesh"]().run(mesh, 600, "cad", "preset", "", "loops=0.5")
    assert np.array_equal(quads.quads, quadwright.remesh(points, faces, faces=600, preset="cad", loops=0.5).quads)
    assert len(triangles["faces"]) == 2 * len(quads.quads) and "quads, 8 irregular" in told


def test_asset(nodes, cube, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points, faces = cube
    result, triangles, color, normal, told = nodes["QuadwrightAsset"]().run({"vertices": points, "faces": faces}, 100, texture=64)
    same = quadwright.asset(points, faces, faces=100, texture=64)
    assert np.array_equal(result.quads, same.quads) and len(triangles["faces"]) == 2 * len(same.quads) and "charts" in told
    assert np.asarray(normal).shape == np.asarray(color).shape == (1, 64, 64, 3)
    assert np.allclose(np.asarray(normal)[0], same.maps["normal"] / 255)
    assert np.asarray(color).max() <= 1
    path = nodes["QuadwrightSave"]().run(result, "cube", "glb")["result"][0]
    assert b"normalTexture" in pathlib.Path(path).read_bytes()


def test_wrong_options_are_named(nodes, cube):
    mesh = {"vertices": cube[0], "faces": cube[1]}
    with pytest.raises(ValueError, match="^options: quadwright has no option 'nothing'"):
        nodes["QuadwrightRemesh"]().run(mesh, 100, options="nothing=1")
    with pytest.raises(ValueError, match="^vertices: a batch of 2"):
        nodes["QuadwrightRemesh"]().run({"vertices": np.stack([cube[0]] * 2), "faces": cube[1]}, 100)


def test_save(nodes, cube, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    quads = nodes["QuadwrightRemesh"]().run({"vertices": cube[0], "faces": cube[1]}, 100)[0]
    first = nodes["QuadwrightSave"]().run(quads, "made/cube", "obj")["result"][0]
    second = nodes["QuadwrightSave"]().run(quads, "made/cube", "obj")["result"][0]
    assert first != second and len(quadwright.load(first).faces) == len(quads.quads) and quadwright.load(first).faces.shape[1] == 4
    nodes["QuadwrightSave"]().run({"vertices": cube[0], "faces": cube[1]}, "cube", "glb")
    with pytest.raises(ValueError, match="leads out"):
        nodes["QuadwrightSave"]().run(quads, "../cube", "obj")
