"""Texture coordinates of the result's own, and maps: as the command line's, in arrays and in files."""
import json
import pickle
import struct
import subprocess
import zlib

import numpy as np
import pytest
import quadwright


def put_png(path, pixels):
    """uint8 (height, width, 3)."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


@pytest.fixture(scope="module")
def textured(surface, tmp_path_factory):
    """A torus whose left half is red and whose right half is blue, by a texture: an OBJ with an MTL and a PNG."""
    folder = tmp_path_factory.mktemp("textured")
    points, faces = surface
    pixels = np.zeros((16, 64, 3), np.uint8)
    pixels[:, :32, 0] = pixels[:, 32:, 2] = 255
    put_png(folder / "halves.png", pixels)
    (folder / "torus.mtl").write_text("newmtl skin\nmap_Kd halves.png\n")
    lines = ["mtllib torus.mtl", "usemtl skin"] + [f"v {p[0]:.17g} {p[1]:.17g} {p[2]:.17g}" for p in points]
    lines += [f"vt {0.5 + p[0] / 4:.17g} 0.5" for p in points]
    lines += ["f " + " ".join(f"{v + 1}/{v + 1}" for v in face) for face in faces]
    (folder / "torus.obj").write_text("\n".join(lines) + "\n")
    return folder / "torus.obj"


def run_tool(tool, *arguments):
    subprocess.run([tool, "asset", *map(str, arguments), "-q"], check=True)


@pytest.mark.parametrize("ending", ["glb", "obj"])
def test_bytes_of_the_tool(tool, tmp_path, textured, ending):
    for folder in ("ours", "theirs"):
        (tmp_path / folder).mkdir()
    result = quadwright.asset(quadwright.load(textured), faces=300, texture=128, samples=1)
    result.save(tmp_path / f"ours/a.{ending}")
    run_tool(tool, textured, "-o", tmp_path / f"theirs/a.{ending}", "--faces", 300, "--texture", 128, "--samples", 1, "--json", tmp_path / "report.json")
    names = sorted(p.name for p in (tmp_path / "theirs").iterdir())
    assert names == (["a.glb"] if ending == "glb" else ["a.mtl", "a.obj", "a_color.png", "a_normal.png"])
    assert names == sorted(p.name for p in (tmp_path / "ours").iterdir())
    for name in names:
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes(), name
    assert json.loads((tmp_path / "report.json").read_text())["asset"] == result.asset


def test_several_files(tool, tmp_path, surface, textured):
    """One square for all; each keeps its colour where they lie in one another."""
    points, faces = surface
    quadwright.save(tmp_path / "white.ply", points * [1, 1.25, 1], faces)
    mesh = quadwright.load(textured, tmp_path / "white.ply")
    assert mesh.attributes["object"].names == ["torus", "white"]
    result = quadwright.asset(mesh, faces=400, texture=128)
    result.save(tmp_path / "ours.glb")
    run_tool(tool, textured, tmp_path / "white.ply", "-o", tmp_path / "theirs.glb", "--faces", 400, "--texture", 128)
    assert (tmp_path / "ours.glb").read_bytes() == (tmp_path / "theirs.glb").read_bytes()
    assert quadwright.load(tmp_path / "ours.glb").attributes["object"].names == ["torus", "white"]
    with pytest.raises(quadwright.FileMissingError, match="nowhere"):
        quadwright.load(textured, tmp_path / "nowhere.obj")


def test_arrays(textured):
    result = quadwright.asset(quadwright.load(textured), faces=300, texture=128, bake=["color", "normal", "height"])
    assert {n: (m.dtype.name, m.shape) for n, m in result.maps.items()} == {
        "color": ("uint8", (128, 128, 3)), "normal": ("uint8", (128, 128, 3)), "height": ("uint16", (128, 128, 1))}
    uv = result.attributes["uv"].values.reshape(-1, 4, 2)
    assert result.attributes["uv"].per == "corner" and uv.min() >= 0 and uv.max() <= 1
    middles, places = result.vertices[result.quads].mean(axis=1), uv.mean(axis=1)
    sure = np.abs(middles[:, 0]) > 0.15
    texels = result.maps["color"][(128 * (1 - places[:, 1])).astype(int), (128 * places[:, 0]).astype(int)]
    red = texels[:, 0] > 128
    assert np.array_equal(red[sure], (middles[:, 0] < 0)[sure])
    assert result.asset["charts"] >= 2 and result.asset["color_error"] < 4 and result.asset["overlapping_charts"] == 0


def test_tiles(surface):
    result = quadwright.asset(*surface, faces=300, texture=128, tiles=2, texel_density=30, bake="normal")
    assert result.asset["tiles"] == 2 and sorted(result.maps) == ["normal", "normal.1002"]


def test_colours_of_vertices(surface):
    points, faces = surface
    colours = np.where(points[:, :1] > 0, [[0.2, 0.4, 0.6]], [[0.6, 0.2, 0.2]]).astype(np.float32)
    result = quadwright.asset(points, faces, attributes={"color": colours}, faces=300, texture=64)
    covered = result.maps["color"].reshape(-1, 3)
    assert sorted(result.maps) == ["color", "normal"]
    assert (np.abs(covered.astype(int) - [51, 102, 153]).max(axis=1) <= 1).sum() > 1000
    assert quadwright.remesh(points, faces, faces=300, bake="normal").maps["normal"].shape == (2048, 2048, 3)


def test_unwrap(tool, tmp_path, textured):
    mesh = quadwright.load(textured)
    result = quadwright.remesh(mesh, faces=300, unwrap=True, texture=512, margin=2)
    assert not result.maps and result.asset["texels"] is None and result.asset["charts"] >= 2
    result.save(tmp_path / "ours.obj")
    subprocess.run([tool, textured, "-o", tmp_path / "theirs.obj", "--faces", "300", "--unwrap", "--texture", "512", "--margin", "2", "-q"], check=True)
    assert (tmp_path / "ours.obj").read_bytes() == (tmp_path / "theirs.obj").read_bytes()
    assert quadwright.remesh(mesh, faces=300).asset is None


def test_what_is_wrong(surface, tmp_path):
    with pytest.raises(ValueError, match="^bake: must be input, all, or any of"):
        quadwright.asset(*surface, faces=300, bake="colour")
    with pytest.raises(TypeError, match="^bake: must be a str"):
        quadwright.asset(*surface, faces=300, bake=7)
    with pytest.raises(TypeError, match="^texture: must be a whole number"):
        quadwright.asset(*surface, faces=300, texture="large")
    with pytest.raises(quadwright.OptionError, match="^texture: "):
        quadwright.asset(*surface, faces=300, texture=7)
    with pytest.raises(TypeError, match="did you mean texture"):
        quadwright.asset(*surface, faces=300, textures=7)
    remesher = quadwright.Remesher(*surface)
    first = remesher.remesh(faces=300, bake="normal", texture=64)
    with pytest.raises(ValueError, match="^path: "):
        first.save(tmp_path / "a.xyz")
    with pytest.raises(quadwright.ArgumentError, match="maps are written with GLB, glTF and OBJ only"):
        first.save(tmp_path / "a.ply")
    again = pickle.loads(pickle.dumps(first))
    assert np.array_equal(again.maps["normal"], first.maps["normal"])
    with pytest.raises(RuntimeError, match="^maps: "):
        again.save(tmp_path / "a.glb")
    second = remesher.remesh(faces=200, bake="normal", texture=64)
    with pytest.raises(RuntimeError, match="another result since"):
        first.save(tmp_path / "a.glb")
    second.save(tmp_path / "a.glb")
    assert [p.name for p in tmp_path.iterdir()] == ["a.glb"]


def test_cancel(surface):
    told = []

    def progress(stage, fraction):
        told.append(stage)
        return quadwright.CANCEL if len(told) > 1 else None  # a quick machine tells of a stage once

    with pytest.raises(quadwright.Cancelled):
        quadwright.asset(*surface, faces=300, progress=progress)


def test_files_of_many(textured, tmp_path):
    from quadwright import _result_of_file

    options, target = {"bake": "input", "faces": 300, "texture": 64}, str(tmp_path / "torus.obj")
    first = _result_of_file(str(textured), target, options)
    assert (tmp_path / "torus_color.png").exists() and _result_of_file(str(textured), target, options) == first
    before = (tmp_path / "torus_color.png").read_bytes()
    put_png(textured.parent / "halves.png", np.full((16, 64, 3), 255, np.uint8))  # another texture: it is made again
    assert _result_of_file(str(textured), target, options)["key"] != first["key"]
    assert (tmp_path / "torus_color.png").read_bytes() != before


def test_bytes_of_a_file(textured, tmp_path):
    mesh, same = quadwright.load(textured), quadwright.load_memory(textured.read_bytes())
    assert np.array_equal(mesh.vertices, same.vertices) and sorted(mesh.attributes) == sorted(same.attributes) and same.scene is None
    quadwright.asset(mesh, faces=300, texture=64).save(tmp_path / "a.glb")
    again = quadwright.load_memory(bytearray((tmp_path / "a.glb").read_bytes()))
    assert again.scene is not None and quadwright.asset(again, faces=200, texture=64).maps["color"].shape == (64, 64, 3)
    with pytest.raises(TypeError):
        quadwright.load_memory("a.glb")
