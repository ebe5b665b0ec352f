"""Meshes of VTK, PyVista and Open3D, real ones: what is not installed is skipped."""
import shutil
import subprocess

import numpy as np
import pytest

import quadwright


def vtk_mesh(points, faces, **arrays):
    support = pytest.importorskip("vtkmodules.util.numpy_support", reason="VTK's Python package is not installed (Debian: python3-vtk9)")
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    mesh, places, polygons = vtkPolyData(), vtkPoints(), vtkCellArray()
    places.SetData(support.numpy_to_vtk(points, deep=1))
    mesh.SetPoints(places)
    polygons.SetData(support.numpy_to_vtkIdTypeArray(np.arange(0, faces.size + 1, 3, dtype=np.int64), deep=1),
                     support.numpy_to_vtkIdTypeArray(faces.reshape(-1).astype(np.int64), deep=1))
    mesh.SetPolys(polygons)
    for name, values in arrays.items():
        array = support.numpy_to_vtk(values, deep=1)
        array.SetName(name)
        (mesh.GetPointData() if len(values) == len(points) else mesh.GetCellData()).AddArray(array)
    return mesh


def test_vtk(surface):
    points, faces = surface
    labels = (np.arange(len(faces)) % 2).astype(np.int32)
    mesh = vtk_mesh(points, faces, heat=points[:, 0], part=labels)
    result = quadwright.remesh(mesh, faces=200)
    assert np.array_equal(result.quads, quadwright.remesh(points, faces, faces=200).quads)
    assert set(result.attributes) == {"heat", "part"} and result.attributes["part"].per == "face"
    back = result.to_vtk()
    assert back.GetNumberOfPolys() == len(result.quads) and back.GetNumberOfPoints() == len(result.vertices)
    assert back.GetPointData().GetArray("heat") is not None and back.GetCellData().GetArray("part") is not None
    again = quadwright.remesh(back, faces=100)  # quads in, of VTK
    assert np.array_equal(again.quads, quadwright.remesh(result, faces=100).quads)
    assert quadwright.measure(back)["faces"] == len(result.quads)


def test_vtk_without_polygons():
    pytest.importorskip("vtkmodules.vtkCommonDataModel", reason="VTK's Python package is not installed (Debian: python3-vtk9)")
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    with pytest.raises(ValueError, match="^faces: the mesh has no polygons"):
        quadwright.remesh(vtkPolyData())


def test_pyvista(surface):
    pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed, and Debian has no package of it")
    points, faces = surface
    result = quadwright.remesh(pyvista.PolyData.from_regular_faces(points, faces), faces=200)
    assert result.to_pyvista().n_cells == len(result.quads)


def test_open3d(surface):
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed (Debian: python3-open3d)")
    points, faces = surface
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(points), open3d.utility.Vector3iVector(faces.astype(np.int32)))
    mesh.vertex_colors = open3d.utility.Vector3dVector(np.clip(np.abs(points), 0, 1))
    result = quadwright.remesh(mesh, faces=200)
    assert np.array_equal(result.quads, quadwright.remesh(points, faces, faces=200).quads)
    assert result.attributes["color"].per == "vertex"
    back = result.to_open3d()
    assert len(back.triangles) == 2 * len(result.quads) and back.has_vertex_colors()
    if hasattr(open3d, "t"):
        tensors = open3d.t.geometry.TriangleMesh.from_legacy(mesh)
        assert len(quadwright.remesh(tensors, faces=200).quads) == len(result.quads)


def test_gmsh_reads_the_quads(surface, tmp_path):
    pytest.importorskip("meshio", reason="meshio is not installed (Debian: python3-meshio)")
    if not shutil.which("gmsh"):
        pytest.skip("gmsh is not installed (Debian: gmsh)")
    result = quadwright.remesh(*surface, faces=200)
    result.to_meshio().write(tmp_path / "quads.msh", file_format="gmsh")
    subprocess.run(["gmsh", "-0", "quads.msh", "-o", "back.msh", "-format", "msh2"], cwd=tmp_path, check=True, capture_output=True)
    elements = (tmp_path / "back.msh").read_text().split("$Elements\n")[1].splitlines()
    assert int(elements[0]) == len(result.quads) and elements[1].split()[1] == "3"  # gmsh's number of quads


def ball_of_points(count=4000):
    i = np.arange(count)
    z, a = 1 - (2 * i + 1) / count, i * 2.399963229728653
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(a), r * np.sin(a), z], 1)


def check_ball(result):
    assert result.report["boundary_loops"] == 0 and result.report["components"] == 1 and result.report["euler"] == 2
    assert np.abs(np.linalg.norm(result.vertices, axis=1) - 1).max() < 0.03


def test_points():
    points = ball_of_points()
    result = quadwright.remesh(points, faces=300, wrap=0.1, attributes={"height": points[:, 2].astype(np.float32)})
    check_ball(result)
    assert np.abs(result.attributes["height"].values.reshape(-1) - result.vertices[:, 2]).max() < 0.1
    check_ball(quadwright.remesh(points, faces=300, wrap="2q"))
    with pytest.raises(quadwright.NoFacesError):
        quadwright.remesh(points[:2], wrap=True)
    with pytest.raises(TypeError, match="missing"):
        quadwright.measure(points)


def test_points_of_open3d():
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed (Debian: python3-open3d)")
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(ball_of_points()))
    cloud.colors = open3d.utility.Vector3dVector(np.full((4000, 3), [1, 0.5, 0]))
    result = quadwright.remesh(cloud, faces=300, wrap=0.1)
    check_ball(result)
    assert np.allclose(result.attributes["color"].values[:, :3], [1, 0.5, 0], atol=0.01)


def test_points_of_vtk():
    support = pytest.importorskip("vtkmodules.util.numpy_support", reason="VTK's Python package is not installed (Debian: python3-vtk9)")
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    cloud, places = vtkPolyData(), vtkPoints()
    places.SetData(support.numpy_to_vtk(ball_of_points(), deep=1))
    cloud.SetPoints(places)
    check_ball(quadwright.remesh(cloud, faces=300, wrap=0.1))
