"""usage: build.py WHEEL FOLDER: the workbench as a zip in the folder, whole in itself: with the Python package of the wheel in it. It is unpacked into FreeCAD's folder Mod."""
import pathlib
import re
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent


def main(wheel, folder):
    version, platform = re.match(r"quadwright-([^-]+)-.*-([^-]+)\.whl", pathlib.Path(wheel).name).groups()
    if f"<version>{version}</version>" not in (HERE / "Quadwright/package.xml").read_text():
        sys.exit(f"build.py: Quadwright/package.xml does not have the version {version} of the wheel")
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    path = pathlib.Path(folder) / f"quadwright-freecad-{version}-{platform}.zip"
    with zipfile.ZipFile(wheel) as source, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:

        def put(name, data):
            target.writestr(zipfile.ZipInfo(f"Quadwright/{name}", (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)

        for file in sorted((HERE / "Quadwright").rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts:
                put(file.relative_to(HERE / "Quadwright").as_posix(), file.read_bytes())
        put("LICENSE", (HERE.parent.parent / "LICENSE").read_bytes())
        for name in sorted(source.namelist()):
            if name.startswith("quadwright/"):
                put(f"lib/{name}", source.read(name))
    print(path)


main(*sys.argv[1:])
