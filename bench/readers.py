"""Files of elements, read back by the programs that they are for: gmsh, meshio and VTK, and CalculiX; shapes of quads beside Verdict's (vtkMeshQuality). The quads are made with --jacobian-min 0.3.

usage: readers.py QUADWRIGHT MESH... [--faces 600]   (needs Debian's gmsh, python3-meshio, python3-vtk9 and calculix-ccx; run it by /usr/bin/python3)"""
import contextlib, io, json, pathlib, re, subprocess, sys, tempfile

import meshio, vtk
from vtk.util.numpy_support import vtk_to_numpy

DECK = """*INCLUDE, INPUT={name}
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SHELL SECTION, ELSET=EALL, MATERIAL=STEEL
0.01
*BOUNDARY
{held}, 1, 3
*STEP
*STATIC
*DLOAD
EALL, P, 0.001
*NODE FILE
U
*END STEP
"""
FORMATS = [("msh", []), ("vtu", []), ("inp", []), ("bdf", []), ("msh", ["--second-order"]), ("vtu", ["--second-order"]), ("inp", ["--second-order"]), ("bdf", ["--second-order"])]


def told(command, folder=None):
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=folder)
    return run.returncode, run.stdout + run.stderr


def by_gmsh(path):
    code, text = told(["gmsh", "-check", path])
    found = re.search(r"(\d+) nodes.*?(\d+) elements", text, re.S)
    return f"{found[1]} nodes, {found[2]} elements" if found and code == 0 and "Error" not in text else "FAILED"


def by_meshio(path):
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            mesh = meshio.read(path)
    except BaseException as error:
        return f"FAILED: {type(error).__name__} {error}"[:60]
    counts = {}
    for block in mesh.cells: counts[block.type] = counts.get(block.type, 0) + len(block.data)
    return ", ".join(f"{count} {kind}" for kind, count in counts.items())


def by_vtk(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    return f"{grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells" if grid.GetNumberOfCells() else "FAILED"


def by_ccx(path, folder):
    held = "features" if "features" in path.read_text() else "boundary_1"
    (folder / "job.inp").write_text(DECK.format(name=path.name, held=held))
    _, text = told(["ccx", "job"], folder)
    return "job finished" if "Job finished" in text else "FAILED " + " ".join(re.findall(r"\*ERROR[^\n]*", text)[:1])


def verdict(path):
    """Least and mean of VTK's scaled Jacobian, largest aspect ratio and warpage."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    found = {}
    for name in ("ScaledJacobian", "AspectRatio", "Warpage"):
        judge = vtk.vtkMeshQuality()
        judge.SetInputConnection(reader.GetOutputPort())
        getattr(judge, f"SetQuadQualityMeasureTo{name}")()
        judge.Update()
        grid = judge.GetOutput()
        values = vtk_to_numpy(grid.GetCellData().GetArray("Quality"))
        is_quad = [grid.GetCellType(i) == vtk.VTK_QUAD for i in range(grid.GetNumberOfCells())]
        found[name] = values[is_quad]
    return found


def main(words):
    faces = 600
    if "--faces" in words:
        at = words.index("--faces")
        faces = words[at + 1]
        del words[at:at + 2]
    tool, meshes = words[0], [pathlib.Path(word) for word in words[1:]]
    print("| mesh | file | gmsh | meshio | VTK | CalculiX |\n|---|---|---|---|---|---|")
    shapes = []
    for mesh in meshes:
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for ending, extra in FORMATS:
                path = folder / f"shell{len(extra)}.{ending}"
                code, text = told([tool, mesh, "-o", path, "--faces", faces, "--jacobian-min", "0.3", "--quiet", *extra])
                if code:
                    print(f"| {mesh.name} | .{ending} | {text.strip()[-80:]} |")
                    continue
                cells = [by_gmsh(path) if ending == "msh" else "", by_meshio(path), by_vtk(path) if ending == "vtu" else "", by_ccx(path, folder) if ending == "inp" else ""]
                print(f"| {mesh.name} | .{ending}{', quad8' if extra else ''} |", " | ".join(cells), "|", flush=True)
            theirs = verdict(folder / "shell0.vtu")
            told([tool, mesh, "-o", folder / "quads.obj", "--faces", faces, "--jacobian-min", "0.3", "--quiet"])
            ours = json.loads(told([tool, "measure", folder / "quads.obj", "--json"])[1])
            shapes.append(
                f"| {mesh.name} | {ours['min_scaled_jacobian']:.6f}, {theirs['ScaledJacobian'].min():.6f} | {ours['mean_scaled_jacobian']:.6f}, {theirs['ScaledJacobian'].mean():.6f} "
                f"| {ours['max_aspect']:.6f}, {theirs['AspectRatio'].max():.6f} | {ours['max_warp']:.6f}, {theirs['Warpage'].min():.6f} |"
            )
    print("\n| mesh | least scaled Jacobian: ours, Verdict's | mean | largest aspect | most warpage, and Verdict's least (1 less it) |\n|---|---|---|---|---|")
    print("\n".join(shapes))


if __name__ == "__main__":
    main(sys.argv[1:])
