"""What is carried along: attributes in and out, where the result lies on the input, files, and what is wrong with arguments."""
import json
import subprocess

import numpy as np
import pytest
import quadwright
from quadwright import Attribute


def same(a, b):
    return np.array_equal(a.vertices, b.vertices) and np.array_equal(a.quads, b.quads)


def smooth(points):
    return np.stack([points[:, 0] + points[:, 2], 1 - points[:, 1]], -1)


@pytest.fixture(scope="module", params=[0, 0.5])
def carried(surface, request):
    points, faces = surface
    corner_uv = smooth(points)[faces]
    labels = (points[faces].mean(axis=1)[:, 0] > 0).astype(np.int64)
    groups = np.tile(np.arange(2), (len(points), 1))
    share = (points[:, :1] + 1.5) / 3
    return quadwright.remesh(points, faces, faces=600, follow_motion=request.param, attributes={
        "heat": points[:, 1].astype(np.float32), "uv": corner_uv, "shape": Attribute(smooth(points), "vertex"),
        "normal": points / np.linalg.norm(points, axis=1)[:, None], "side": Attribute(labels, names=["left", "right"]),
        "skin": Attribute(np.concatenate([share, 1 - share], 1), kind="weights", groups=groups), "many": np.tile(points[:, :1], 16)})


def test_what_comes_out(carried):
    a, vertices, corners = carried.attributes, carried.vertices, carried.quads.reshape(-1)
    assert list(a) == ["heat", "uv", "shape", "normal", "side", "skin", "many"]
    assert a["heat"].values.dtype == np.float32 and a["heat"].values.shape == (len(vertices),)
    assert np.abs(a["heat"].values - vertices[:, 1]).max() < 0.02
    assert a["uv"].per == "corner" and a["uv"].kind == "uvs" and a["uv"].values.shape == (len(corners), 2)
    assert np.abs(a["uv"].values - smooth(vertices)[corners]).max() < 0.05
    assert np.abs(np.asarray(a["shape"]) - smooth(vertices)).max() < 0.02
    assert a["normal"].kind == "normals" and np.allclose(np.linalg.norm(a["normal"].values, axis=1), 1, atol=1e-5)
    assert a["side"].names == ["left", "right"] and a["side"].per == "face" and a["side"].values.dtype == np.int32
    middles = vertices[carried.quads].mean(axis=1)[:, 0]
    clear = np.abs(middles) > 0.2
    assert np.array_equal(a["side"].values[clear], (middles[clear] > 0).astype(int))
    weights, groups = a["skin"].values, a["skin"].groups
    assert weights.shape == groups.shape == (len(vertices), 2) and groups.dtype == np.uint32
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-5)
    of_first = np.where(groups == 0, weights, 0).sum(axis=1)
    assert np.abs(of_first - (vertices[:, 0] + 1.5) / 3).max() < 0.02
    assert a["many"].values.shape == (len(vertices), 16) and not a["many"].values.flags.owndata
    assert carried.transfer["charts"] >= 1 and carried.transfer["filled_faces"] == 0
    assert "labels per face" in repr(a["side"])


def test_faces_in_closed_holes_are_marked(surface, tmp_path):
    points, faces = surface
    ring = faces[~(faces == 0).any(axis=1)]  # without the faces around a vertex
    result = quadwright.remesh(points, ring, faces=600, fill_holes=40)
    marks = result.attributes["filled"]
    assert marks.names == ["surface", "filled"] and marks.per == "face" and len(marks.values) == len(result.quads)
    middles, share = result.vertices[result.quads].mean(axis=1), (marks.values == 1).mean()
    assert 0 < share < 0.1
    assert np.linalg.norm(middles[marks.values == 1] - points[0], axis=1).max() < 0.5
    result.save(tmp_path / "marked.ply")
    assert "filled" in quadwright.load(tmp_path / "marked.ply").attributes
    assert "filled" not in quadwright.remesh(*surface, faces=400, fill_holes=40).attributes


def test_quads_are_the_same_without(surface, carried):
    assert same(carried, quadwright.remesh(*surface, faces=600))


def test_provenance(surface, carried):
    points, faces = surface
    plain = quadwright.remesh(points, faces, faces=600, provenance=True)
    assert np.array_equal(plain.provenance.vertices, carried.provenance.vertices)
    assert quadwright.remesh(points, faces, faces=600).provenance is None
    p = plain.provenance
    assert len(p.vertices) == len(plain.vertices) and len(p.corners) == plain.quads.size and p.lost_vertices == (p.vertices["face"] < 0).sum()
    assert p.lost_corners == 0 and not p.vertices.flags.owndata
    assert np.allclose(p.vertices["weight"].sum(axis=1), 1, atol=1e-5)
    triangle = np.take_along_axis(faces[p.vertices["face"]], p.vertices["corner"], 1)
    places = (points[triangle] * p.vertices["weight"][:, :, None]).sum(axis=1)
    assert np.linalg.norm(places - plain.vertices, axis=1).max() == pytest.approx(p.farthest, abs=1e-5)
    assert p.farthest < 0.01 and "0 without a place" in repr(p)


def test_attributes_are_copied(surface):
    points, faces = surface
    heat = points[:, 1].astype(np.float32)
    remesher = quadwright.Remesher(points, faces, attributes={"heat": heat})
    first = remesher.remesh(faces=200).attributes["heat"].values
    heat[:] = 7
    assert np.array_equal(first, remesher.remesh(faces=200).attributes["heat"].values)


def test_most_weights(surface):
    points, faces = surface
    weights = Attribute(np.full((len(points), 4), 0.25), kind="weights", groups=np.tile(np.arange(4), (len(points), 1)))
    result = quadwright.remesh(points, faces, faces=200, attributes={"w": weights}, most_weights=2)
    assert result.attributes["w"].values.shape == (len(result.vertices), 2) and result.transfer["dropped_weights"] > 0


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_bytes_of_the_tool(tool, tmp_path, surface, suffix):
    points, faces = surface
    source, ours, theirs, report = (str(tmp_path / n) for n in (f"in.{suffix}", f"ours.{suffix}", f"theirs.{suffix}", "report.json"))
    attributes = {"uv": smooth(points)[faces], "color": np.clip((points[:, [0, 1, 2]] + 2) * 60, 0, 255).astype(np.uint8)}
    if suffix == "obj":
        attributes["material"] = Attribute((points[faces].mean(axis=1)[:, 1] > 0).astype(int), names=["skin", "cloth"])
        attributes["smoothing"] = (points[faces].mean(axis=1)[:, 0] > 0).astype(int)
    else:
        attributes["part"] = (points[faces].mean(axis=1)[:, 1] > 0).astype(np.int16)
        attributes["heat"] = points[:, 2]
    quadwright.save(source, points, faces, attributes=attributes)
    mesh = quadwright.load(source)
    assert set(attributes) <= set(mesh.attributes)
    assert np.allclose(mesh.attributes["color"].values * 255, attributes["color"], atol=0.51)
    result = quadwright.remesh(mesh, faces=400)
    result.save(ours)
    subprocess.run([tool, source, "-o", theirs, "--faces", "400", "-q", "--json", report], check=True)
    with open(ours, "rb") as a, open(theirs, "rb") as b:
        assert a.read() == b.read()
    with open(report) as file:
        told = json.load(file)["attributes"]
    assert all(told[name] == count for name, count in result.transfer.items() if name in told)
    quadwright.remesh(mesh, faces=400, attributes={}).save(ours)
    subprocess.run([tool, source, "-o", theirs, "--faces", "400", "-q", "--no-attributes"], check=True)
    with open(ours, "rb") as a, open(theirs, "rb") as b:
        assert a.read() == b.read()


def test_library_of_an_obj(tool, tmp_path):
    source = tmp_path / "cube.obj"
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    source.write_text("mtllib a.mtl\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in corners) +
                      "".join(f"usemtl m{i % 2}\nf {' '.join(map(str, side))}\n" for i, side in enumerate(sides)))
    mesh = quadwright.load(source)
    assert mesh.library == "a.mtl" and mesh.attributes["material"].names == ["m0", "m1"]
    quadwright.remesh(mesh, faces=150).save(tmp_path / "ours.obj")
    subprocess.run([tool, source, "-o", tmp_path / "theirs.obj", "--faces", "150", "-q"], check=True)
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    assert b"mtllib a.mtl" in (tmp_path / "ours.obj").read_bytes()


def test_keep(tool, tmp_path, surface):
    points, faces = surface
    material = Attribute((points[faces].mean(axis=1)[:, 0] > 0).astype(int), names=["skin", "cloth"])
    source, theirs, ours = tmp_path / "in.obj", tmp_path / "theirs.obj", tmp_path / "ours.obj"
    quadwright.save(source, points, faces, attributes={"material": material})
    subprocess.run([tool, source, "-o", theirs, "--faces", "500", "-q", "--keep", "materials"], check=True)
    mesh = quadwright.load(source)
    kept = quadwright.remesh(mesh, faces=500, keep="materials")
    kept.save(ours)
    assert ours.read_bytes() == theirs.read_bytes() and kept.report["feature_edges"] > 20
    again = quadwright.remesh(points, faces, attributes={"material": material}, keep=["material"], faces=500)
    assert np.array_equal(again.quads, quadwright.remesh(points, faces, attributes={"material": material}, keep="materials", faces=500).quads)
    with pytest.raises(ValueError, match="^keep: .*seams|^keep: .*uv"):
        quadwright.remesh(mesh, keep="seams")
    for wrong, error in ((3, TypeError), ("", ValueError), ([], ValueError), ([3], TypeError)):
        with pytest.raises(error, match="^keep"):
            quadwright.remesh(mesh, keep=wrong)


def test_marks_of_a_file_are_no_arguments(tool, tmp_path, surface):
    """Borders of smoothing groups are marks of an OBJ; as in the command line they count only where an option says so."""
    points, faces = surface
    source, theirs = tmp_path / "in.obj", tmp_path / "theirs.obj"
    quadwright.save(source, points, faces, attributes={"smoothing": (points[faces].mean(axis=1)[:, 0] > 0).astype(int) + 1})
    mesh = quadwright.load(source)
    assert mesh.marked_edges is not None
    for given, flags in (({}, []), ({"sharp_marks": True}, ["--sharp-marks"])):
        result = quadwright.remesh(mesh, faces=300, **given)
        result.save(tmp_path / "ours.obj")
        subprocess.run([tool, source, "-o", theirs, "--faces", "300", "-q", *flags], check=True)
        assert (tmp_path / "ours.obj").read_bytes() == theirs.read_bytes()
        assert (result.report["feature_edges"] > 0) == bool(given)


def test_polygons(surface):
    """A polygon's corners and labels, where a face is not a triangle."""
    quads = quadwright.remesh(*surface, faces=600)
    sizes = np.full(len(quads.quads), 4)
    corner = quads.vertices[quads.quads].reshape(-1, 3)
    result = quadwright.remesh(quads.vertices, quads.quads.reshape(-1), face_sizes=sizes, faces=200,
                               attributes={"p": Attribute(corner, "corner"), "f": Attribute(np.arange(len(sizes)), "face")})
    assert np.abs(result.attributes["p"].values - result.vertices[result.quads.reshape(-1)]).max() < 0.1
    assert result.attributes["f"].values.min() >= 0 and result.attributes["f"].values.max() < len(sizes)
    again = quadwright.remesh(result, faces=100)  # a result brings its attributes along
    assert list(again.attributes) == ["p", "f"]


def test_meshio_and_trimesh(surface):
    points, faces = surface
    meshio = pytest.importorskip("meshio")
    mesh = meshio.Mesh(points, [("triangle", faces)], point_data={"heat": points[:, 0], "name": np.full(len(points), "x")},
                       cell_data={"part": [(points[faces].mean(axis=1)[:, 0] > 0).astype(int)]})
    result = quadwright.remesh(mesh, faces=200)
    assert list(result.attributes) == ["heat", "part"]
    back = result.to_meshio()
    assert np.array_equal(back.point_data["heat"], result.attributes["heat"].values)
    assert np.array_equal(back.cell_data["part"][0], result.attributes["part"].values)

    class Visual:
        uv, kind, vertex_colors = smooth(points), "vertex", np.full((len(points), 4), 51, np.uint8)

    class Trimesh:
        vertices, visual, vertex_attributes, face_attributes = points, Visual(), {"heat": points[:, 0]}, {}

    Trimesh.faces = faces
    like = quadwright.remesh(Trimesh(), faces=200)
    assert list(like.attributes) == ["uv", "color", "heat"] and np.allclose(like.attributes["color"].values, 0.2, atol=1e-6)


def test_colours_of_vertices_and_faces(tmp_path, surface):
    points, faces = surface
    quadwright.save(tmp_path / "both.ply", points, faces, attributes={
        "color": np.full((len(points), 3), 10, np.uint8), "of faces": Attribute(np.full((len(faces), 3), 20, np.uint8), name="color")})
    mesh = quadwright.load(tmp_path / "both.ply")
    assert sorted(mesh.attributes) == ["color", "color per face"]
    quadwright.save(tmp_path / "again.ply", mesh)
    assert (tmp_path / "again.ply").read_bytes() == (tmp_path / "both.ply").read_bytes()


N, M = 4, 4  # of the tetrahedron below


@pytest.mark.parametrize("attribute, error, says", [
    (np.zeros(5), ValueError, "5 rows"), (np.zeros(N), ValueError, "per="), (Attribute(np.zeros(N), "corner"), ValueError, "4 rows per corner"),
    (np.zeros((12, 17)), ValueError, "17 columns"), (Attribute(np.zeros((N, 2)), "vertex", "normals"), ValueError, "2 columns; normals have 3"),
    (Attribute(np.zeros((M, 2)), "face", "uvs"), ValueError, "uvs go by vertex or corner"), (np.zeros((3, 2, 2, 2)), ValueError, "shape"),
    (np.full(12, np.nan), ValueError, "nan at row 0"), (np.full(12, 1e300), ValueError, "inf at row 0"), (["a"] * N, TypeError, "numbers"),
    (np.zeros(12, complex), TypeError, "numbers"), (object(), TypeError, ""), (Attribute(np.array([0, 1, 2, 5]), "face", names=["a", "b"]), ValueError, "label 5"),
    (Attribute(np.array([0, 1, -2, 0]), "face", names=["a", "b"]), ValueError, "label -2"), (Attribute(np.array([2**40] * 4), "face"), ValueError, "32 bits"),
    (Attribute(np.zeros(4), "face", "labels"), TypeError, "whole numbers"), (Attribute(np.zeros((N, 2)), "vertex", "weights"), ValueError, "groups"),
    (Attribute(np.zeros((N, 2)), "vertex", "weights", groups=np.zeros((N, 1), int)), ValueError, "shape"),
    (Attribute(np.full((N, 1), -1.0), "vertex", "weights", groups=np.zeros((N, 1), int)), ValueError, "below 0"),
    (Attribute(np.zeros((N, 1)), "vertex", "weights", groups=np.full((N, 1), -1)), ValueError, "groups go from 0"),
    (Attribute(np.zeros((N, 1)), "vertex", "weights", groups=np.zeros((N, 1))), TypeError, "groups"),
    (Attribute(np.zeros(12), names=["a"]), ValueError, "only labels"), (Attribute(np.zeros(4, int), "face", names=["a\nb"]), ValueError, "control"),
    (Attribute(np.zeros(4, int), "face", names=[3]), TypeError, "a label's name"),
])
def test_wrong_attributes(attribute, error, says):
    points, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    with pytest.raises(error, match=rf"^attributes\['it'\].*{says}"):
        quadwright.remesh(points, faces, attributes={"it": attribute})
    with pytest.raises(error, match=r"^attributes\['it'\]"):
        quadwright.save("/nowhere/a.ply", points, faces, attributes={"it": attribute})


def test_wrong_words(surface):
    for wrong in ({"per": "edge"}, {"kind": "colour"}, {"storage": "float16"}):
        with pytest.raises(ValueError, match=f"^{next(iter(wrong))}: must be"):
            Attribute([1, 2], **wrong)
    with pytest.raises(TypeError, match="^attributes: must be a dict"):
        quadwright.remesh(*surface, attributes=[1])
    with pytest.raises(TypeError, match="^attributes: a name"):
        quadwright.remesh(*surface, attributes={3: np.zeros(3)})
    with pytest.raises(ValueError, match="name is empty"):
        quadwright.remesh(*surface, attributes={"": np.zeros(len(surface[0]))})
    for wrong in (17, -1, 0.5, "2"):
        with pytest.raises(ValueError, match="^most_weights"):
            quadwright.remesh(*surface, most_weights=wrong)


# ---- regions, normals, glTF


@pytest.fixture
def two_materials(tmp_path, surface):
    points, faces = surface
    material = Attribute((points[faces].mean(axis=1)[:, 0] > 0).astype(int), names=["skin", "cloth"])
    path = tmp_path / "in.obj"
    quadwright.save(path, points, faces, attributes={"material": material, "uv": smooth(points)[faces]})
    return path


def test_region(tool, tmp_path, two_materials):
    mesh = quadwright.load(two_materials)
    inside = mesh.attributes["material"].values == mesh.attributes["material"].names.index("cloth")
    result = quadwright.remesh(mesh, region="material=cloth", faces=300)
    assert np.array_equal(result.faces, quadwright.remesh(mesh, region=inside, faces=300).faces)
    kept = result.report["kept_faces"]
    assert kept == (~inside).sum() and result.face_sizes is not None and len(result.face_sizes) == len(result.quads) + kept
    assert (result.face_sizes[:len(result.quads)] == 4).all() and (result.face_sizes[len(result.quads):] == 3).all()
    assert len(result.attributes["material"].values) == len(result.face_sizes) and len(result.attributes["uv"].values) == len(result.faces)
    assert set(map(tuple, mesh.vertices[mesh.faces[~inside]].reshape(-1, 3))) <= set(map(tuple, result.vertices))  # what stays stays
    result.save(tmp_path / "ours.obj")
    subprocess.run([tool, two_materials, "-o", tmp_path / "theirs.obj", "--faces", "300", "-q", "--region", "material=cloth"], check=True)
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    assert result.measure()["euler"] == 0 and [b.type for b in result.to_meshio().cells] == ["quad", "triangle"]
    remesher = quadwright.Remesher(mesh, region=inside)
    remesher.set_region(None)
    assert np.array_equal(remesher.remesh(faces=300).quads, quadwright.remesh(mesh, faces=300).quads)


@pytest.mark.parametrize("region, error, says", [
    ("velvet", ValueError, "velvet"), (np.zeros(3, bool), ValueError, "shape"), (np.full(2304, 2), ValueError, "face 0"), (np.full(2304, 0.5), TypeError, "True or False"),
    (np.zeros(2304, bool), ValueError, ""), (3, ValueError, "shape"), ("a\nb", ValueError, "control"),
])
def test_wrong_regions(two_materials, region, error, says):
    with pytest.raises(error, match=f"^region: .*{says}"):
        quadwright.remesh(quadwright.load(two_materials), region=region)


def test_normals(tool, tmp_path, two_materials):
    mesh = quadwright.load(two_materials)
    for normals, per in (("smooth", "vertex"), ("split", "corner")):
        result = quadwright.remesh(mesh, faces=300, normals=normals)
        normal = result.attributes["normal"]
        assert normal.kind == "normals" and normal.per == per and np.allclose(np.linalg.norm(normal.values, axis=1), 1, atol=1e-5)
        result.save(tmp_path / "ours.obj")
        subprocess.run([tool, two_materials, "-o", tmp_path / "theirs.obj", "--faces", "300", "-q", "--normals", normals], check=True)
        assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    again = quadwright.remesh(result, faces=200, normals="none")
    assert "normal" not in again.attributes and "normal" in quadwright.remesh(result, faces=200).attributes
    with pytest.raises(ValueError, match="^normals: must be input, none, smooth, split"):
        quadwright.remesh(mesh, normals="flat")


def test_gltf(tool, tmp_path):
    import pathlib
    import os
    import pickle

    root = pathlib.Path(os.environ.get("QUADWRIGHT_ROOT") or pathlib.Path(__file__).parents[3])
    source = root / "tests/data/io/scene.glb"
    if not source.exists():
        pytest.skip("no tests/data beside these tests")
    mesh = quadwright.load(source)
    assert mesh.scene is not None
    result = quadwright.remesh(mesh, faces=60)
    result.save(tmp_path / "ours.glb")
    subprocess.run([tool, source, "-o", tmp_path / "theirs.glb", "--faces", "60", "-q"], check=True)
    assert (tmp_path / "ours.glb").read_bytes() == (tmp_path / "theirs.glb").read_bytes()
    quadwright.remesh(mesh, faces=60, attributes={}).save(tmp_path / "bare.glb")
    subprocess.run([tool, source, "-o", tmp_path / "theirs.glb", "--faces", "60", "-q", "--no-attributes"], check=True)
    assert (tmp_path / "bare.glb").read_bytes() == (tmp_path / "theirs.glb").read_bytes()
    assert pickle.loads(pickle.dumps(mesh)).scene is None
    mesh.scene = object()
    with pytest.raises(TypeError, match="^scene"):
        mesh.save(tmp_path / "a.glb")
    subprocess.run([tool, "batch", source.parent, "--out", tmp_path / "many", "--faces", "60", "--format", "glb", "-q"])
    assert (tmp_path / "many/scene.glb.quads.glb").read_bytes() == (tmp_path / "ours.glb").read_bytes()
