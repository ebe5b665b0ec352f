"""usage: build.py WHEEL FOLDER [HERE] | build.py --index FOLDER URL
The add-on's zip in FOLDER, and index.json, which makes the folder a repository that Blender 4.2 and later can be pointed at. With --index that of all
zips in FOLDER, to be fetched from URL. HERE: a wheel of the same version that runs on this system, where WHEEL does not: it is asked for tables. The same zip loads in older versions, by bl_info. MIT, as all that is not inside the add-on."""
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

try:
    import tomllib
except ImportError:
    sys.exit("build.py: Python 3.11 or later is needed")

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE / "quadwright_remesh"
TAGS = {
    "3D View",
    "Add Curve",
    "Add Mesh",
    "Animation",
    "Bake",
    "Camera",
    "Compositing",
    "Development",
    "Game Engine",
    "Geometry Nodes",
    "Grease Pencil",
    "Import-Export",
    "Lighting",
    "Material",
    "Modeling",
    "Mesh",
    "Node",
    "Object",
    "Paint",
    "Pipeline",
    "Physics",
    "Render",
    "Rigging",
    "Scene",
    "Sculpt",
    "Sequencer",
    "System",
    "Text Editor",
    "Tracking",
    "User Interface",
    "UV",
}
PLATFORMS = {"windows-x64", "windows-arm64", "macos-arm64", "macos-x64", "linux-x64"}
PERMISSIONS = {"files", "network", "clipboard", "camera", "microphone"}
NEEDED = ("schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license")
VERSION = re.compile(r"^[0-9]+\.[0-9]+\.[0-9]+([-+].+)?$")


def platform_of(wheel):
    """Blender's name of the platform in the wheel's tag."""
    tag = wheel.stem.split("-")[-1]
    for pattern, name in (
        ("linux.*x86_64", "linux-x64"),
        ("win_amd64", "windows-x64"),
        ("win_arm64", "windows-arm64"),
        ("macosx.*arm64", "macos-arm64"),
        ("macosx.*x86_64", "macos-x64"),
    ):
        if re.search(pattern, tag):
            return name
    raise SystemExit(f"build.py: {wheel.name} is for no platform that Blender has")


def table_of(wheel, name):
    """A table of the library, "options" or "presets", asked of the wheel."""
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(wheel).extractall(folder)
        code = f"import sys; sys.path.insert(0, {folder!r}); import json, quadwright; print(json.dumps(quadwright.{name}()))"
        return json.loads(subprocess.run([sys.executable, "-s", "-B", "-c", code], check=True, capture_output=True, text=True).stdout)


def problems(manifest, names):
    """What Blender's rules find wrong with a manifest, sentences; names: files in the zip, beside the manifest."""
    wrong = [f"{key} is missing" for key in NEEDED if not manifest.get(key)]
    if wrong:
        return wrong
    if manifest["schema_version"] != "1.0.0":
        wrong.append("schema_version is not 1.0.0")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", manifest["id"]) or "__" in manifest["id"]:
        wrong.append("id is no identifier")
    wrong += [f"{key} is no version" for key in ("version", "blender_version_min") if not VERSION.match(manifest[key])]
    if tuple(map(int, manifest["blender_version_min"].split("."))) < (4, 2, 0):
        wrong.append("blender_version_min is below 4.2.0")
    if "blender" in manifest["name"].lower() or "blender" in manifest["id"].lower():
        wrong.append("the name has Blender in it")
    reasons = manifest.get("permissions", {})
    for what, text in [("tagline", manifest["tagline"])] + [(f"the reason of {name}", reason) for name, reason in reasons.items()]:
        if not 0 < len(text) <= 64 or not text[-1].isalnum() and text[-1] not in ")]}":
            wrong.append(f"{what} must have 1 to 64 letters and no full stop at its end")
    wrong += [f"there is no permission {name}" for name in reasons if name not in PERMISSIONS]
    wrong += [f"there is no tag {tag}" for tag in manifest.get("tags", []) if tag not in TAGS]
    wrong += [f"there is no platform {name}" for name in manifest.get("platforms", []) if name not in PLATFORMS]
    if manifest["type"] not in ("add-on", "theme"):
        wrong.append("type is neither add-on nor theme")
    if "SPDX:GPL-3.0-or-later" not in manifest["license"] or not all(name.startswith("SPDX:") for name in manifest["license"]):
        wrong.append("license must have SPDX:GPL-3.0-or-later, and each must begin with SPDX:")
    for wheel in manifest.get("wheels", []):
        if not wheel.startswith("./wheels/") or wheel[2:] not in names:
            wrong.append(f"the wheel {wheel} is not in ./wheels")
    wrong += [f"{name} in wheels is not in the manifest" for name in names if name.startswith("wheels/") and "./" + name not in manifest.get("wheels", [])]
    return wrong


def write_zip(path, files):
    """files: {name: bytes}. The same files make the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name in sorted(files):
            info = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            target.writestr(info, files[name])


def write_index(folder, url):
    """index.json of all zips of a folder, each by its own manifest, a platform each; url: of the folder."""
    entries = []
    for path in sorted(folder.glob("quadwright_remesh-*.zip")):
        data = path.read_bytes()
        with zipfile.ZipFile(path) as archive:
            manifest = tomllib.loads(archive.read("quadwright_remesh/blender_manifest.toml").decode())
        entry = {key: value for key, value in manifest.items() if key not in ("wheels", "build", "copyright")}
        entry.update(archive_url=f"{url}/{path.name}", archive_size=len(data), archive_hash="sha256:" + hashlib.sha256(data).hexdigest())
        entries.append(entry)
    (folder / "index.json").write_text(json.dumps({"version": "v1", "blocklist": [], "data": entries}, indent=2) + "\n")


def main(wheel, folder, here=None):
    version, platform = wheel.name.split("-")[1], platform_of(wheel)
    text = (SOURCE / "blender_manifest.toml").read_text().replace("@VERSION@", version).replace("@PLATFORMS@", json.dumps(platform))
    text = text.replace("@WHEELS@", json.dumps(f"./wheels/{wheel.name}"))
    files = {path.name: path.read_bytes() for path in SOURCE.glob("*.py")}
    files["__init__.py"] = files["__init__.py"].replace(b'"version": (0, 1, 0)', f'"version": ({", ".join(version.split("."))})'.encode())
    files["blender_manifest.toml"] = text.encode()
    for name in ("options", "presets"):
        files[f"{name}.json"] = json.dumps(table_of(here or wheel, name), indent=1).encode()
    files[f"wheels/{wheel.name}"] = wheel.read_bytes()
    files["LICENSE-library"] = (HERE.parent.parent / "LICENSE").read_bytes()
    files["LICENSE"] = pathlib.Path(os.environ.get("QUADWRIGHT_GPL", "/usr/share/common-licenses/GPL-3")).read_bytes()  # the text of the GPL; Debian's
    manifest = tomllib.loads(text)
    wrong = problems(manifest, set(files))
    if wrong:
        raise SystemExit("build.py: blender_manifest.toml: " + "; ".join(wrong))
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.zip"):
        old.unlink()
    path = folder / f"{manifest['id']}-{version}-{platform}.zip"
    write_zip(path, {f"{manifest['id']}/{name}": data for name, data in files.items()})
    write_index(folder, ".")
    print(path)


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    if sys.argv[1] == "--index":
        write_index(pathlib.Path(sys.argv[2]), sys.argv[3].rstrip("/"))
        sys.exit()
    main(*map(pathlib.Path, sys.argv[1:]))
