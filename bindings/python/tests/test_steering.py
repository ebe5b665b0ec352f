"""What a caller knows of how the quads are to run: densities, guides, cross fields, planes of symmetry."""
import subprocess

import numpy as np
import pytest
import quadwright
import ringed
from quadwright import Attribute, Guide


def ring(radius, height, count=60):
    a = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([radius * np.cos(a), radius * np.sin(a), np.full(count, height)], -1)


def edge_lengths(result):
    p = result.vertices[result.quads]
    return np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2).mean(axis=1), p.mean(axis=1)


def test_density(tool, tmp_path, surface):
    points, faces = surface
    density = np.where(points[:, 0] > 0, 3, 1)
    result = quadwright.remesh(points, faces, density=density, faces=2000)
    lengths, middles = edge_lengths(result)
    ratio = np.median(lengths[middles[:, 0] < -0.6]) / np.median(lengths[middles[:, 0] > 0.6])
    assert 2.4 < ratio < 3.6 and abs(len(result.quads) - 2000) < 80
    remesher = quadwright.Remesher(points, faces)
    remesher.set_density(density.astype(np.float32))
    assert np.array_equal(remesher.remesh(faces=2000).quads, result.quads)
    remesher.set_density(None)
    assert np.array_equal(remesher.remesh(faces=300).quads, quadwright.remesh(points, faces, faces=300).quads)
    source = tmp_path / "in.ply"
    quadwright.save(source, points, faces, attributes={"fine": density.astype(float)})
    subprocess.run([tool, source, "-o", tmp_path / "theirs.obj", "--faces", "2000", "-q", "--density", "fine", "--no-attributes"], check=True)
    result.save(tmp_path / "ours.obj")
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()


@pytest.mark.parametrize("density, error, says", [
    (np.ones(3), ValueError, "shape"), (np.ones((1152, 1)), ValueError, "shape"), (np.full(1152, np.nan), ValueError, "nan at vertex 0"),
    (np.zeros(1152), ValueError, "0.0 at vertex 0"), (np.full(1152, 2000), ValueError, "2000"), (["a"] * 1152, TypeError, "numbers"), (3.5, ValueError, "shape"),
    (np.ones(1152, bool), TypeError, "numbers"),
])
def test_wrong_densities(surface, density, error, says):
    assert len(surface[0]) == 1152
    with pytest.raises(error, match=f"^density: .*{says}"):
        quadwright.remesh(*surface, density=density)


def test_guides(tool, tmp_path, surface):
    points, faces = surface
    loop = ring(1.4 * 0.999, 0.0)
    result = quadwright.remesh(points, faces, guides=[Guide(loop, closed=True)], faces=600)
    assert result.report["guide_edges"] > 20 and 0 <= result.report["guide_off"] < 0.1
    assert np.array_equal(result.quads, quadwright.remesh(points, faces, guides=[np.vstack([loop, loop[:1]])], faces=600).quads)
    line = Guide(ring(1.4, 0.0)[:8], "direction")
    mixed = quadwright.remesh(points, faces, guides=[line], faces=600)
    assert mixed.report["guide_edges"] == 0 and "direction of 8 points" in repr(line)
    path = tmp_path / "guides.obj"
    path.write_text("".join("v %.17g %.17g %.17g\n" % tuple(p) for p in loop) + "l " + " ".join(map(str, [*range(1, 61), 1])) + "\n")
    source = tmp_path / "in.ply"
    quadwright.save(source, points, faces)
    from_file = quadwright.remesh(quadwright.load(source), guides=path, faces=600)
    from_file.save(tmp_path / "ours.obj")
    subprocess.run([tool, source, "-o", tmp_path / "theirs.obj", "--faces", "600", "-q", "--guides", path], check=True)
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    assert np.array_equal(from_file.quads, result.quads)
    rings = Guide(loop, closed=True, rings=2)
    nested = quadwright.remesh(points, faces, guides=[rings], faces=600)
    path.write_text("g rings 2\n" + path.read_text())
    assert np.array_equal(nested.quads, quadwright.remesh(points, faces, guides=path, faces=600).quads)
    assert not np.array_equal(nested.quads, result.quads) and "2 rings" in repr(rings)
    for wrong in ({"rings": 2}, {"rings": -1, "closed": True}, {"rings": 2, "closed": True, "kind": "direction"}, {"rings": True, "closed": True}):
        with pytest.raises(ValueError, match="^rings: "):
            Guide(loop, **wrong)


@pytest.mark.parametrize("name", ringed.PLACES)
def test_one_guide_gives_rings(tool, tmp_path, name):
    """In Python, and in the command line tool with the guide in a file."""
    points, faces, loop = ringed.make(name)
    result = quadwright.remesh(points, faces, guides=[Guide(loop, closed=True, rings=3)], faces=3000)
    found = ringed.rings(name, result.vertices, result.quads)
    assert min(found) >= 1 and sum(found) >= 4  # on each side, beside the loop itself
    source, guides = tmp_path / "in.ply", tmp_path / "guides.obj"
    quadwright.save(source, points, faces)
    guides.write_text("g rings 3\n" + "".join("v %.17g %.17g %.17g\n" % tuple(p) for p in loop) + "l " + " ".join(map(str, [*range(1, 13), 1])) + "\n")
    subprocess.run([tool, source, "-o", tmp_path / "theirs.obj", "--faces", "3000", "-q", "--guides", guides], check=True)
    result.save(tmp_path / "ours.obj")
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()


@pytest.mark.parametrize("guides, error, says", [
    (3, TypeError, "list"), ([[[0, 0, 0]]], ValueError, "1 points"), ([Guide([[0, 0, 0]] * 2, closed=True)], ValueError, "3 or more"),
    ([[[0, 0, 0], [1, 1, float("nan")]]], ValueError, "nan at row 1"), ([np.zeros((3, 2))], ValueError, "shape"), ([None], TypeError, ""),
    ("/no/such/file.obj", quadwright.FileMissingError, "file.obj"), ([ring(3, 0)], quadwright.ArgumentError, "guide 0 is off the surface"),
])
def test_wrong_guides(surface, guides, error, says):
    with pytest.raises(error, match=rf"^guides(\[0\])?: .*{says}"):
        quadwright.remesh(*surface, guides=guides, faces=300)


def test_field_goes_round(tool, tmp_path, surface):
    points, faces = surface
    for per, count in (("vertex", len(points)), ("face", len(faces))):
        first = quadwright.remesh(points, faces, faces=400, field_per=per)
        assert first.field.shape == (count, 3) and first.field.dtype == np.float32
        assert np.allclose(np.linalg.norm(first.field, axis=1), 1, atol=1e-4)
        second = quadwright.remesh(points, faces, faces=400, field=first.field, field_per=per)
        assert np.array_equal(second.field, first.field) and second.report["field_angle"] < 10
    assert quadwright.remesh(points, faces, faces=100).field is None
    source = tmp_path / "in.ply"
    quadwright.save(source, points, faces)
    subprocess.run([tool, source, "-o", tmp_path / "a.obj", "--faces", "400", "-q", "--field-out", tmp_path / "f.rosy", "--field-per", "face"], check=True)
    subprocess.run([tool, source, "-o", tmp_path / "b.obj", "--faces", "400", "-q", "--field-in", tmp_path / "f.rosy"], check=True)
    from_file = quadwright.remesh(quadwright.load(source), faces=400, field=tmp_path / "f.rosy")
    from_file.save(tmp_path / "ours.obj")
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "b.obj").read_bytes()


@pytest.mark.parametrize("field, error, says", [
    (np.zeros((3, 3)), ValueError, "3 rows"), (np.zeros(5), ValueError, "shape"), (np.full((1152, 3), np.nan), ValueError, "nan at row 0"),
    ([["a"] * 3] * 1152, TypeError, "numbers"), (Attribute(np.ones((2304, 3)), "vertex"), ValueError, "2304 rows"),
    (Attribute(np.ones((6912, 3)), "corner"), ValueError, "rows"), ("/no/such.rosy", quadwright.FileMissingError, "such.rosy"),
])
def test_wrong_fields(surface, field, error, says):
    with pytest.raises(error, match=f"^field: .*{says}"):
        quadwright.remesh(*surface, field=field)
    with pytest.raises(ValueError, match="^field_per"):
        quadwright.remesh(*surface, field_per="edge")


def test_field_that_is_another_mesh_s(surface):
    points, faces = surface
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    with pytest.raises(quadwright.ArgumentError, match="^field: .*30 degrees"):
        quadwright.remesh(points, faces, field=normals)


def test_as_many_faces_as_vertices():
    points, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    with pytest.raises(ValueError, match="^field: .*as many"):
        quadwright.remesh(points, faces, field=np.zeros((4, 3)))
    assert len(quadwright.remesh(points, faces, field=Attribute(np.zeros((4, 3)), "face"), faces=50).quads)


def mirrored(result, normal, offset):
    """The largest distance of a mirrored vertex from the next vertex."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    p = result.vertices
    q = p - 2 * ((p @ normal) - offset)[:, None] * normal
    return max(np.linalg.norm(p - one, axis=1).min() for one in q)


def test_symmetry(tool, tmp_path, surface):
    points, faces = surface
    for given, normal in (({"symmetry": "x"}, (1, 0, 0)), ({"symmetry": (0, 2, 0, 0)}, (0, 1, 0)), ({"symmetry": [1, 0, 0, 0.0]}, (1, 0, 0)),
                          ({"symmetry": "plane", "symmetry_z": 1, "symmetry_offset": 0}, (0, 0, 1))):
        result = quadwright.remesh(points, faces, faces=400, **given)
        assert result.report["symmetric"] and mirrored(result, normal, 0) < 1e-9
    assert mirrored(quadwright.remesh(points, faces, faces=400), (1, 0, 0), 0) < 1e-9  # which is the default
    assert mirrored(quadwright.remesh(points, faces, faces=400, symmetry="none"), (1, 0, 0), 0) > 1e-3
    source = tmp_path / "in.ply"
    quadwright.save(source, points, faces)
    subprocess.run([tool, source, "-o", tmp_path / "theirs.obj", "--faces", "400", "-q", "--symmetry", "0,2,0,0"], check=True)
    quadwright.remesh(points, faces, faces=400, symmetry=(0, 2, 0, 0)).save(tmp_path / "ours.obj")
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    for wrong, error in (("w", quadwright.OptionError), (3, TypeError), ((1, 2, 3), TypeError), ((0, 0, 0, 1), TypeError), (("a",) * 4, TypeError)):
        with pytest.raises(error, match="symmetry"):
            quadwright.remesh(points, faces, symmetry=wrong)


def test_motion():
    """Weights steer by themselves. The ends of the tube, which have rings too, are left out."""
    n, m = 48, 80
    a, z = np.meshgrid(2 * np.pi * np.arange(n) / n, np.linspace(-4, 4, m))
    points = np.stack([np.cos(a), np.sin(a), z], -1).reshape(-1, 3)
    i, k = np.meshgrid(np.arange(m - 1) * n, np.arange(n), indexing="ij")
    faces = np.stack([i + k, i + (k + 1) % n, i + n + (k + 1) % n, i + n + k], -1).reshape(-1, 4)
    weight = np.clip(0.5 + (points[:, 2] + 0.7 * points[:, 1]) / 2, 0, 1)
    weights = Attribute(np.stack([1 - weight, weight], -1).astype(np.float32), "vertex", "weights", groups=np.tile(np.array([0, 1], np.uint32), (len(points), 1)))
    remesher = quadwright.Remesher(points, faces, attributes={"weights": weights})
    assert remesher.remesh(faces=600, rings=0).report["nests"] == 1
    without = remesher.remesh(faces=600, rings=0, follow_motion=0)
    assert without.report["nests"] == 0
    assert np.array_equal(without.quads, quadwright.remesh(points, faces, faces=600, rings=0).quads)
