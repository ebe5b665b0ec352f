"""usage: run.py FOLDER [headless|window|table]...: the tests of the zip in FOLDER (tools/blender-addon). Each Blender has a home and a folder for
temporary files of its own; what is left there afterwards is a failure. The last line is "N passed, N failed"."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True
import build  # noqa: E402
import tomllib  # noqa: E402

LIMIT_S = 3600  # ends hangs only


def check(name, holds, told=""):
    print(f"{name} ... {'ok' if holds else 'FAIL ' + told}", flush=True)
    return bool(holds)


def manifest_tests(folder):
    """The zip, its manifest by Blender's rules, and the index."""
    (path,) = folder.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        tops = {name.split("/")[0] for name in names}
        inside = {name.split("/", 1)[1] for name in names}
        text = archive.read("quadwright_remesh/blender_manifest.toml").decode()
        init = archive.read("quadwright_remesh/__init__.py").decode()
        wheel = [archive.read(name) for name in names if name.endswith(".whl")]
        sources = {name: archive.read(name).decode() for name in names if name.endswith(".py")}
    manifest = tomllib.loads(text)
    yield check("one folder in the zip", tops == {"quadwright_remesh"})
    yield check("the manifest keeps the rules", build.problems(manifest, inside) == [], str(build.problems(manifest, inside)))
    broken = [
        ("name", "Quads for Blender"),
        ("tagline", "Ends with a full stop."),
        ("tagline", "x" * 65),
        ("version", "1"),
        ("blender_version_min", "3.4.0"),
        ("license", ["GPL"]),
        ("license", ["SPDX:MIT"]),
        ("tags", ["Quads"]),
        ("platforms", ["linux"]),
        ("permissions", {"files": "Ends so."}),
        ("permissions", {"disk": "Reads"}),
        ("id", "quad remesh"),
        ("wheels", ["./wheels/none.whl"]),
        ("wheels", []),
        ("type", "addon"),
        ("schema_version", "2"),
        ("maintainer", ""),
    ]
    for key, value in broken:
        yield check(f"a manifest with {key} = {value!r:.40} is refused", build.problems({**manifest, key: value}, inside))
    version = tuple(map(int, manifest["version"].split(".")))
    yield check("bl_info has the same version", f'"version": {version}' in init)
    yield check("the wheel is the one that was built", len(wheel) == 1 and wheel[0] == next((folder.parent / "wheels").glob("*.whl")).read_bytes())
    yield check(
        "the add-on's Python is under the GPL, and says so", all(s.startswith("# SPDX-License-Identifier: GPL-3.0-or-later") for s in sources.values())
    )
    yield check(
        "nothing is written beside the add-on, and sys.path is left alone",
        not any(re.search(r"sys\.path\.(insert|append)|open\([^)]*__file__", s) for s in sources.values() if "options.json" not in s),
    )
    index = json.loads((folder / "index.json").read_text())
    entry = index["data"][0]
    data = path.read_bytes()
    import hashlib

    yield check(
        "the index tells of the zip",
        entry["archive_size"] == len(data)
        and entry["archive_hash"] == "sha256:" + hashlib.sha256(data).hexdigest()
        and entry["archive_url"] == "./" + path.name,
    )
    yield check("the index has what a repository needs", index["version"] == "v1" and all(entry.get(key) for key in build.NEEDED))
    again = pathlib.Path(tempfile.mkdtemp())
    build.main(next((folder.parent / "wheels").glob("*.whl")), again)
    yield check("the same wheel makes the same zip", (again / path.name).read_bytes() == data)
    shutil.rmtree(again)


def blender(folder, script, arguments=(), window=False):
    """(passed, failed) of a script in Blender."""
    home = pathlib.Path(tempfile.mkdtemp(prefix="blender-home-"))
    temporary = home / "tmp"
    temporary.mkdir()
    environment = dict(os.environ, HOME=str(home), TMPDIR=str(temporary), QUADWRIGHT_BLENDER_OUT=str(folder), PYTHONDONTWRITEBYTECODE="1")
    for name in ("TOOL", "SHAPES"):
        environment.setdefault(f"QUADWRIGHT_{name}", "")
    environment.pop("XDG_CONFIG_HOME", None)
    command = ["blender", "-b"] if not window else ["xvfb-run", "-a", "-s", "-screen 0 1280x960x24", "blender", "-p", "0", "0", "1280", "960"]
    command += ["-noaudio", "--factory-startup", "--python-exit-code", "1", "-P", str(HERE / script), "--", *arguments]
    log = ""
    process = subprocess.Popen(
        ["timeout", "-k", "5", str(LIMIT_S), *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment, errors="replace"
    )
    for line in process.stdout:
        log += line
        if re.search(r"\.\.\. |^ok$|^FAIL$|^ERROR$|^    \S", line) or "Error" in line and not line.startswith("Error: "):
            print(line, end="", flush=True)
    code = process.wait()
    found = re.findall(r'^\{"ran": (\d+), "failed": (\d+)\}$', log, re.M)
    ran, failed = map(int, found[-1]) if found else (1, 1)
    if code != 0 and failed == 0 and not (window and code == 1):  # a Blender in which Esc was pressed ends with status 1
        failed = 1
        print(f"{script} ended with status {code}")
    if failed:
        print(log[-6000:])
    if "Not freed memory blocks" in log:
        failed += 1
        print(f"{script} leaks: " + re.search("Not freed memory blocks.*", log)[0])
    left = sorted(str(p.relative_to(temporary)) for p in temporary.rglob("*") if p.name != "quit.blend" and not p.name.startswith("xvfb-run"))
    kept = check(f"{script} leaves no file", left == [], str(left))
    shutil.rmtree(home, ignore_errors=True)
    return ran - failed + kept, failed + (not kept)


def main(folder, chosen):
    passed = failed = 0
    if not chosen or "manifest" in chosen:
        results = list(manifest_tests(folder))
        passed, failed = passed + sum(results), failed + len(results) - sum(results)
    pictures = folder / "pictures"
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir()
    for name, script, arguments, window in (
        ("headless", "headless.py", (), False),
        ("window", "window.py", (str(pictures),), True),
        ("table", "table.py", (str(folder / "table.md"),), False),
    ):
        if not chosen or name in chosen:
            more = blender(folder, script, arguments, window)
            passed, failed = passed + more[0], failed + more[1]
    print(f"{passed} passed, {failed} failed")
    return failed


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(1 if main(pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]) else 0)
