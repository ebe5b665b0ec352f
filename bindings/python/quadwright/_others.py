"""Meshes of VTK, PyVista and Open3D, in and out. Arrays in are views of theirs where their types allow, and none of the packages is imported before one of its
objects is seen, or asked for."""
import numpy as np


def is_vtk(mesh):
    """vtkPolyData, of which pyvista.PolyData is a kind."""
    return hasattr(mesh, "GetPolys") and hasattr(mesh, "GetPointData")


def is_open3d(mesh):
    return type(mesh).__module__.startswith("open3d") and (hasattr(mesh, "triangles") or hasattr(mesh, "triangle"))


def of_vtk(mesh):
    """points, corners, sizes, {name: array of vertices}, {name: array of faces}"""
    from vtkmodules.util.numpy_support import vtk_to_numpy  # type: ignore[import]

    if mesh.GetStrips().GetNumberOfCells():
        raise ValueError("faces: the mesh has triangle strips; its triangles are made by triangulate() of PyVista, or vtkTriangleFilter")
    if mesh.GetPoints() is None or mesh.GetPolys().GetNumberOfCells() == 0:
        raise ValueError("faces: the mesh has no polygons")
    polygons = mesh.GetPolys()
    offsets, corners = vtk_to_numpy(polygons.GetOffsetsArray()), vtk_to_numpy(polygons.GetConnectivityArray())
    before = mesh.GetVerts().GetNumberOfCells() + mesh.GetLines().GetNumberOfCells()
    tables = []
    for data, begin in ((mesh.GetPointData(), 0), (mesh.GetCellData(), before)):
        found = {}
        coordinates = data.GetTCoords()
        for i in range(data.GetNumberOfArrays()):
            array = data.GetArray(i)
            if array is not None and array.GetName():
                found["uv" if array is coordinates else array.GetName()] = vtk_to_numpy(array)[begin:]
        tables.append(found)
    return vtk_to_numpy(mesh.GetPoints().GetData()), corners, np.diff(offsets), *tables


def points_of_vtk(mesh):
    """points, {name: array}, where there are no polygons; or None"""
    from vtkmodules.util.numpy_support import vtk_to_numpy  # type: ignore[import]

    if mesh.GetPoints() is None or mesh.GetPolys().GetNumberOfCells() or mesh.GetStrips().GetNumberOfCells():
        return None
    data = mesh.GetPointData()
    arrays = [data.GetArray(i) for i in range(data.GetNumberOfArrays())]
    return vtk_to_numpy(mesh.GetPoints().GetData()), {a.GetName(): vtk_to_numpy(a) for a in arrays if a is not None and a.GetName()}


def points_of_open3d(cloud):
    """points, {name: array}, of both of its kinds of PointCloud; normals are left, as a skin has its own"""
    if hasattr(cloud, "point"):  # open3d.t.geometry
        found = {("color" if name == "colors" else name): tensor.cpu().numpy() for name, tensor in cloud.point.items() if name not in ("positions", "normals")}
        return cloud.point.positions.cpu().numpy(), found
    return np.asarray(cloud.points), {"color": np.asarray(cloud.colors)} if cloud.has_colors() else {}


def of_open3d(mesh):
    """points, triangles, {name: (array, what it belongs to)}, of both of its kinds of triangle meshes"""
    own = {}
    if hasattr(mesh, "triangle"):  # open3d.t.geometry
        def array(tensor):
            return tensor.cpu().numpy()

        for name, tensor in mesh.vertex.items():
            if name != "positions":
                own["color" if name == "colors" else "normal" if name == "normals" else name] = (array(tensor), "vertex")
        return array(mesh.vertex.positions), array(mesh.triangle.indices), own
    if mesh.has_vertex_colors():
        own["color"] = (np.asarray(mesh.vertex_colors), "vertex")
    if mesh.has_triangle_uvs():
        own["uv"] = (np.asarray(mesh.triangle_uvs), "corner")
    if mesh.has_triangle_material_ids():
        own["material"] = (np.asarray(mesh.triangle_material_ids), "face")
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles), own


def to_vtk(result, sizes):
    """A vtkPolyData of polygons, with the attributes of vertices and faces."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray  # type: ignore[import]
    from vtkmodules.vtkCommonCore import vtkPoints  # type: ignore[import]
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData  # type: ignore[import]

    mesh, points, polygons = vtkPolyData(), vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(result.vertices), deep=1))
    mesh.SetPoints(points)
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    corners = np.ascontiguousarray(result.faces.reshape(-1), dtype=np.int64)
    polygons.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(corners, deep=1))
    mesh.SetPolys(polygons)
    for name, attribute in result.attributes.items():
        if attribute.per in ("vertex", "face"):
            array = numpy_to_vtk(np.ascontiguousarray(attribute.values), deep=1)
            array.SetName(name)
            data = mesh.GetPointData() if attribute.per == "vertex" else mesh.GetCellData()
            data.SetTCoords(array) if name == "uv" else data.AddArray(array)
    return mesh


def to_open3d(result, triangles, faces_of):
    """An open3d.geometry.TriangleMesh: two triangles a quad, as Open3D has no polygons."""
    import open3d  # type: ignore[import]

    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(np.ascontiguousarray(result.vertices, dtype=np.float64)),
                                        open3d.utility.Vector3iVector(np.ascontiguousarray(triangles, dtype=np.int32)))
    color, material = result.attributes.get("color"), result.attributes.get("material")
    if color is not None and color.per == "vertex":
        mesh.vertex_colors = open3d.utility.Vector3dVector(np.ascontiguousarray(color.values[:, :3], dtype=np.float64))
    if material is not None and material.per == "face":
        mesh.triangle_material_ids = open3d.utility.IntVector(np.ascontiguousarray(material.values[faces_of], dtype=np.int32))
    return mesh
