"""What comes out: the quads of the command line, whatever the layout of the arrays, however often and on how many threads."""
import base64
import gc
import json
import os
import subprocess
import threading

import numpy as np
import pytest
import quadwright


def same(a, b):
    return np.array_equal(a.vertices, b.vertices) and np.array_equal(a.quads, b.quads)


@pytest.fixture(scope="module")
def reference(surface):
    return quadwright.remesh(*surface, faces=300)


def test_shapes(reference):
    assert reference.vertices.dtype == np.float64 and reference.vertices.shape[1] == 3
    assert reference.quads.dtype == np.int32 and reference.quads.shape[1] == 4
    assert reference.report["faces_asked"] == 300
    assert reference.report["topology"]["quads"] == len(reference.quads)
    assert json.loads(json.dumps(reference.report)) == reference.report
    assert abs(len(reference.quads) - 300) <= 15
    assert reference.report["topology"]["euler"] == 0


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "stl"])
def test_bytes_of_the_tool(tool, tmp_path, surface, suffix):
    source, ours, theirs, report = (str(tmp_path / n) for n in ("in.ply", f"ours.{suffix}", f"theirs.{suffix}", "report.json"))
    quadwright.save(source, *surface)
    mesh = quadwright.load(source)
    result = quadwright.remesh(mesh, faces=400, adaptive=0.5, seed=3)
    result.save(ours)
    subprocess.run([tool, source, "-o", theirs, "--faces", "400", "--adaptive", "0.5", "--seed", "3", "-q", "--json", report], check=True)
    with open(ours, "rb") as a, open(theirs, "rb") as b:
        assert a.read() == b.read()
    with open(report) as file:
        told = json.load(file)
    times = ("seconds", "peak_bytes", "stages")
    assert {k: v for k, v in told["report"].items() if k not in times} == {k: v for k, v in result.report.items() if k not in times}
    figures = result.measure(against=mesh)
    assert {k: figures[k] for k in told["quality"]} == told["quality"]


@pytest.mark.parametrize("layout", ["int32", "uint32", "int64", "uint16", "fortran", "readonly", "strided", "lists"])
def test_layouts(surface, reference, layout):
    points, faces = surface
    if layout in ("int32", "uint32", "int64", "uint16"):
        faces = faces.astype(layout)
    elif layout == "fortran":
        points, faces = np.asfortranarray(points), np.asfortranarray(faces)
    elif layout == "readonly":
        points, faces = points.copy(), faces.astype(np.int32)
        points.flags.writeable = faces.flags.writeable = False
    elif layout == "strided":
        points, faces = np.repeat(points, 2, axis=0)[::2], np.repeat(faces, 3, axis=1)[:, ::3]
    else:
        points, faces = points.tolist(), faces.tolist()
    assert same(quadwright.remesh(points, faces, faces=300), reference)


def test_float32(surface):
    points, faces = surface
    single = points.astype(np.float32)
    assert same(quadwright.remesh(single, faces, faces=300), quadwright.remesh(single.astype(np.float64), faces, faces=300))


def test_polygons_by_sizes(surface, reference):
    points, faces = surface
    sizes = np.full(len(faces), 3)
    assert same(quadwright.remesh(points, faces.reshape(-1), face_sizes=sizes, faces=300), reference)
    again = quadwright.remesh(reference.vertices, reference.quads, faces=200)
    assert same(quadwright.remesh(reference, faces=200), again)


def test_views_keep_the_memory(surface):
    vertices = quadwright.remesh(*surface, faces=200).vertices
    kept = vertices.copy()
    gc.collect()
    for _ in range(3):
        quadwright.remesh(*surface, faces=200)
    assert np.array_equal(vertices, kept) and not vertices.flags.owndata


def test_remesher_is_as_fresh_runs(surface, reference):
    remesher = quadwright.Remesher(*surface)
    first = remesher.remesh(faces=600)
    assert same(remesher.remesh(faces=300), reference)
    assert same(remesher.remesh(faces=600), first)


def test_two_threads(surface, reference):
    results = [None] * 4

    def work(i):
        results[i] = quadwright.remesh(*surface, faces=300)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    [t.start() for t in threads], [t.join() for t in threads]
    assert all(same(r, reference) for r in results)


def test_busy_remesher(surface):
    remesher = quadwright.Remesher(*surface)
    wrong = []

    def inside(stage, fraction):
        if not wrong:
            with pytest.raises(RuntimeError, match="at work"):
                remesher.remesh(faces=100)
            wrong.append(stage)

    remesher.remesh(faces=300, progress=inside)
    assert wrong


def test_marked_edges():
    # a flat sheet with marks across its middle: quads follow them
    n = 24
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    points = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    p = (i * (n + 1) + j).reshape(-1)
    faces = np.concatenate([np.stack([p, p + n + 1, p + n + 2], -1), np.stack([p, p + n + 2, p + 1], -1)])
    diagonal = np.stack([np.arange(n) * (n + 2), np.arange(1, n + 1) * (n + 2)], -1)
    result = quadwright.remesh(points, faces, marked_edges=diagonal, faces=150)
    assert result.report["feature_edges"] >= n
    assert quadwright.remesh(points, faces, faces=150).report["feature_edges"] == 0


def test_flat_memory(surface):
    points, faces = surface

    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    def some(n):
        for _ in range(n):
            quadwright.remesh(points, faces, faces=100, threads=1)
        gc.collect()

    some(10)
    before = resident()
    some(40)
    assert resident() - before < 4 << 20


def test_objects_of_meshio(surface, reference, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = meshio.Mesh(surface[0], [("triangle", surface[1])])
    assert same(quadwright.remesh(mesh, faces=300), reference)
    out = reference.to_meshio()
    assert out.cells[0].type == "quad" and np.array_equal(out.cells[0].data, reference.quads)


def test_objects_like_those_of_trimesh(surface, reference):
    class Trimesh:
        vertices, faces = surface

    assert same(quadwright.remesh(Trimesh(), faces=300), reference)


def test_to_trimesh(surface, reference, monkeypatch):
    """What is handed to trimesh, which Debian has not."""
    import sys
    import types

    class Trimesh:
        def __init__(self, **given):
            self.given = given

    monkeypatch.setitem(sys.modules, "trimesh", types.SimpleNamespace(Trimesh=Trimesh))
    points, faces = surface
    labels, colours = np.arange(len(faces)) % 2, np.tile(np.float32([1, 0.5, 0]), (len(points), 1))
    given = quadwright.remesh(points, faces, faces=300, attributes={"part": labels, "color": colours, "heat": points[:, 0]}).to_trimesh().given
    assert len(given["faces"]) == 2 * len(reference.quads) and given["process"] is False and list(given["vertex_attributes"]) == ["heat"]
    assert np.allclose(given["vertex_colors"], [1, 0.5, 0]) and given["vertex_colors"].shape == (len(given["vertices"]), 3)
    assert len(given["face_attributes"]["part"]) == len(given["faces"])


def test_results_can_be_pickled(surface, reference):
    import pickle

    result = quadwright.remesh(*surface, faces=300, attributes={"heat": surface[0][:, 0]}, field_per="face")
    again = pickle.loads(pickle.dumps(result))
    assert same(again, reference) and np.array_equal(again.provenance.vertices, result.provenance.vertices) and again.report["topology"] == result.report["topology"]
    assert np.array_equal(again.attributes["heat"].values, result.attributes["heat"].values) and np.array_equal(again.field, result.field)


def test_log(surface, caplog, tmp_path):
    with caplog.at_level("DEBUG", "quadwright"):
        quadwright.remesh(*surface, faces=100)
    assert any(record.name == "quadwright" and record.levelname in ("DEBUG", "INFO") for record in caplog.records)
    caplog.clear()
    with caplog.at_level("WARNING", "quadwright"):
        quadwright.remesh(*surface, faces=100)
        assert not caplog.records
        quadwright.save(tmp_path / "a.ply", *surface)
        with open(tmp_path / "a.ply", "ab") as file:
            file.write(b"more than the header tells of")
        quadwright.load(tmp_path / "a.ply")
    assert [record.levelname for record in caplog.records] == ["WARNING"] and "a.ply" in caplog.text


def test_picture(reference, surface, tmp_path):
    path = tmp_path / "sheet.png"
    quadwright.render([reference, surface], path, width=320, height=240, captions=["quads", None])
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    shown = reference._repr_html_()
    assert "data:image/png;base64," in shown and str(len(reference.quads)) in shown


def test_files(tmp_path, surface):
    path = tmp_path / "mesh.off"
    quadwright.save(path, *surface)
    mesh = quadwright.load(path)
    assert np.allclose(mesh.vertices, surface[0]) and np.array_equal(mesh.faces, surface[1])
    with pytest.raises(quadwright.FileMissingError) as info:
        quadwright.load(tmp_path / "none.obj")
    assert isinstance(info.value, FileNotFoundError) and info.value.exit_code == 4 and "none.obj" in str(info.value)


def test_a_record_is_of_the_files_beside_too(surface, tmp_path):
    source, target = str(tmp_path / "in.gltf"), str(tmp_path / "out.obj")
    quadwright.save(source, *surface)
    with open(source) as file:
        told = json.load(file)
    buffer = told["buffers"][0]
    (tmp_path / "a b.bin").write_bytes(base64.b64decode(buffer["uri"].split(",")[1]))
    told["buffers"][0]["uri"] = "a%20b.bin"
    told["images"] = [{"uri": "skin.png"}]
    with open(source, "w") as file:
        json.dump(told, file)
    made = [quadwright._result_of_file(source, target, {"faces": 100})]
    for change in ("nothing", "buffer", "picture"):
        if change == "buffer":
            os.utime(tmp_path / "a b.bin", ns=(1, 1))
        if change == "picture":
            (tmp_path / "skin.png").write_bytes(b"\x89PNG")
        made.append(quadwright._result_of_file(source, target, {"faces": 100}))
        assert (made[-1]["key"] == made[-2]["key"]) == (change == "nothing"), change


def test_what_was_split_is_there(surface):
    assert quadwright.remesh(*surface, faces=60).coarse is None
    result = quadwright.remesh(*surface, faces=60, subdivide=2)
    vertices, quads = result.coarse
    assert len(result.quads) == 16 * len(quads) == 16 * result.report["coarse_faces"]
    assert vertices.shape == (quads.max() + 1, 3) and vertices.dtype == np.float64
    for corner in range(4):  # the first quad of each quarter begins at its corner
        assert (result.quads[4 * corner::16, 0] == quads[:, corner]).all()
    assert result.creases is None


def test_levels_are_those_of_the_command_line(surface, tool, tmp_path):
    """One GLB with a node a level, of the same bytes; other formats hold one mesh."""
    points, faces = surface
    source = tmp_path / "in.ply"
    quadwright.save(source, points, faces)
    levels = quadwright.Remesher(quadwright.load(source)).levels([400, 200, 80])
    assert [len(level.quads) for level in levels] == [len(quadwright.remesh(points, faces, faces=n).quads) for n in (400, 200, 80)]
    quadwright.save_levels(tmp_path / "levels.glb", levels)
    subprocess.run([tool, source, "-o", tmp_path / "told.glb", "--levels", "400,200,80", "--quiet"], check=True)
    data = (tmp_path / "levels.glb").read_bytes()
    assert data == (tmp_path / "told.glb").read_bytes() and b"MSFT_lod" in data
    with pytest.raises(quadwright.UnsupportedError):
        quadwright.save_levels(tmp_path / "levels.obj", levels)


def test_creases_are_those_of_what_was_split():
    """Marks of a cage name vertices of level 0, which has the edges between them."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    cube = corners, np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    for splits in (0, 1):
        result = quadwright.remesh(*cube, faces=96, fit_to="limit", subdivide=splits)
        quads = result.quads if splits == 0 else result.coarse[1]
        ends = np.sort(np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2), 1)
        edges = {tuple(pair) for pair in ends.tolist()}
        creases = np.sort(result.creases[result.creases[:, 0] != result.creases[:, 1]], 1)
        assert len(creases) >= 12 and all(tuple(pair) in edges for pair in creases.tolist())


def test_files_for_simulation_and_cad(surface, tmp_path):
    result = quadwright.remesh(*surface, faces=200)
    for name, head in (("msh", "$MeshFormat"), ("vtu", "<?xml"), ("inp", "*HEADING"), ("bdf", "")):
        result.save(tmp_path / f"a.{name}")
        quadwright.save(tmp_path / f"b.{name}", result)
        text = (tmp_path / f"a.{name}").read_bytes()
        assert text == (tmp_path / f"b.{name}").read_bytes() and head.lower().encode() in text[:200].lower() and len(text) > 1000
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    remesher = quadwright.Remesher(corners, sides)
    with pytest.raises(quadwright.Error):
        remesher.save_patches(tmp_path / "early.step")
    quads = remesher.remesh(faces=200, fit_to="limit").quads
    remesher.save_patches(tmp_path / "quads.step")
    remesher.save_patches(tmp_path / "blocks.step", "blocks")
    written = [(tmp_path / f"{name}.step").read_text() for name in ("quads", "blocks")]
    assert [text.count("ADVANCED_FACE") for text in written] == [len(quads), 6]
    assert [text.count("B_SPLINE_SURFACE_WITH_KNOTS") for text in written] == [len(quads), 0] and written[1].count("=PLANE(") == 6
    with pytest.raises(ValueError, match="^patches_from: must be quads or blocks"):
        remesher.save_patches(tmp_path / "a.step", "rows")
    with pytest.raises(ValueError, match="^path: the ending of .*fbx"):
        result.save(tmp_path / "a.fbx")
