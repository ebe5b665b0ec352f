"""STEP files of limit surfaces, judged by FreeCAD (OCCT): whether they read, are valid shapes, closed and solids, and how far the volume is off that
of the mesh that they were made for.

usage: step.py QUADWRIGHT MESH... [--faces 400] [--from quads|blocks]   (needs Debian's freecad; writes a table to standard output)"""
import pathlib, subprocess, sys, tempfile

JUDGE = """
import Mesh, Part
for line in open({list!r}).read().split("\\n"):
    name, source = line.split("\\t")
    try:
        shape = Part.Shape()
        shape.read(name)
        off = "%.3f" % (100 * abs(shape.Volume / Mesh.Mesh(source).Volume - 1)) if len(shape.Solids) else "-"
        print("JUDGED", name, shape.isValid(), len(shape.Faces), len(shape.Solids), sum(s.isClosed() for s in shape.Shells), len(shape.Shells), "%.6g" % shape.Volume, off)
    except Exception as error:
        print("JUDGED", name, error)
"""


def option(words, name, usual):
    if name not in words:
        return usual
    at = words.index(name)
    value = words[at + 1]
    del words[at:at + 2]
    return value


def main(words):
    faces, source = option(words, "--faces", "400"), option(words, "--from", "quads")
    tool, meshes = words[0], [pathlib.Path(word) for word in words[1:]]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for i, mesh in enumerate(meshes):
            subprocess.run([tool, mesh, "-o", folder / "quads.obj", "--faces", faces, "--quiet", "--patches", folder / f"{i}.step", "--patches-from", source], capture_output=True)
        made = [f"{folder}/{i}.step\t{mesh.resolve()}" for i, mesh in enumerate(meshes) if (folder / f"{i}.step").exists()]
        (folder / "list").write_text("\n".join(made))
        (folder / "judge.py").write_text(JUDGE.format(list=str(folder / "list")))
        told = subprocess.run(["freecadcmd", str(folder / "judge.py")], capture_output=True, text=True).stdout
    rows = {line.split()[1]: line.split()[2:] for line in told.splitlines() if line.startswith("JUDGED")}
    print("| mesh | valid | faces | solids | closed shells | shells | volume | off the mesh's, % |\n|---|---|---|---|---|---|---|---|")
    for i, mesh in enumerate(meshes):
        print(f"| {mesh.name} |", " | ".join(rows.get(str(folder / f"{i}.step"), ["no file"])), "|")


if __name__ == "__main__":
    main(sys.argv[1:])
