#!/usr/bin/python3
"""usage: check.py [FOLDER] | check.py --install FOLDER INTO
Checks the files of packaging/ (FOLDER: those of a rehearsed release, with its hashes), each by its channel's rules: the tool that reads it where
Debian has that (ruby, nix-instantiate, bash, CMake), with a stand-in for what the channel gives it; else its syntax, required fields and limits.
--install builds FOLDER's source archive as AUR's PKGBUILD and vcpkg's port say, into INTO/aur and INTO/vcpkg. Says what is wrong, and fails then."""
import hashlib
import json
import os
import pathlib
import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
import types

import yaml

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))
import fill  # noqa: E402

wrong, left_out = [], []


def want(holds, sentence):
    if not holds:
        wrong.append(sentence)


def said(command, needs):
    """What a command writes; None, noted, where its program is not installed."""
    if not shutil.which(command[0]):
        left_out.append(f"{needs}: there is no {command[0]}")
        return None
    run = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "NIX_STATE_DIR": "/tmp/quadwright-nix", "HOME": "/tmp"})
    want(run.returncode == 0, f"{needs}: {run.stderr.strip()}")
    return run.stdout if run.returncode == 0 else None


def source_of(facts, folder):
    return f"{facts['downloads']}/{facts['source']}", fill.digest(folder, facts["source"], "sha256")


def check_description(facts):
    text = facts["description"]
    want(0 < len(text) <= 64, "about.toml: Blender's tagline has at most 64 letters")
    want(text[-1].isalnum(), "about.toml: Blender's tagline ends without a full stop")
    want(not re.match("(?i)(a|an|the|quadwright) ", text), "about.toml: Homebrew and Nix want no article, and not the name, at the beginning")


def check_conda(base, facts, folder):
    recipe = yaml.safe_load((base / "conda/recipe.yaml").read_text())
    version = facts["version"]
    want(recipe["schema_version"] == 1 and recipe["context"]["version"] == version, "conda: version")
    url, sha256 = source_of(facts, folder)
    want(recipe["source"] == {"url": url.replace(version, "${{ version }}"), "sha256": sha256}, "conda: source")
    known = {"schema_version", "context", "recipe", "package", "source", "build", "requirements", "tests", "outputs", "about", "extra"}
    want(set(recipe) <= known, f"conda: unknown {set(recipe) - known}")
    for output in recipe["outputs"]:
        name = output["package"]["name"]
        want(set(output) <= {"package", "recipe", "source", "build", "requirements", "tests", "about"}, f"conda: {name}: fields")
        want(output.get("tests"), f"conda: {name} has no test")
        want('${{ stdlib("c") }}' in output["requirements"]["build"], f"conda: {name}: a compiler wants stdlib beside it")
    want({"homepage", "repository", "summary", "license", "license_file"} <= set(recipe["about"]), "conda: about")
    want(recipe["extra"]["recipe-maintainers"], "conda: no maintainer")


def check_vcpkg(base, facts, folder):
    port = json.loads((base / "vcpkg/vcpkg.json").read_text())
    want({"name", "version", "description", "homepage", "license"} <= set(port) and port["version"] == facts["version"], "vcpkg: fields")
    want(re.fullmatch("[a-z0-9]+(-[a-z0-9]+)*", port["name"]), "vcpkg: name")
    features = set(port["features"])
    want(set(port["default-features"]) <= features, "vcpkg: default-features")
    used = set(re.findall(r"(?m)^ +(\w+) +QW_\w+$", (base / "vcpkg/portfile.cmake").read_text()))
    want(used == features, f"vcpkg: the port's features are {used}, the manifest's {features}")
    options = set(re.findall("QW_[A-Z_]+", (base / "vcpkg/portfile.cmake").read_text() + (base / "conan/all/conanfile.py").read_text()))
    known = set(re.findall(r"option\((QW_\w+)", (ROOT / "CMakeLists.txt").read_text())) | {"QW_SHARED"}
    want(options <= known, f"CMakeLists.txt has no option {options - known}")


def conan_stand_in(log):
    """Modules of the names that the recipe imports; what it calls is written down."""
    class ConanFile:
        pass

    class Tool:
        def __init__(self, recipe):
            self.cache_variables = {}

        def __getattr__(self, name):
            return lambda *arguments: log.append((name, self.cache_variables))

    def noted(name):
        return lambda recipe, *arguments, **named: log.append((name, arguments, named))

    content = {
        "conan": {"ConanFile": ConanFile},
        "conan.errors": {"ConanInvalidConfiguration": type("ConanInvalidConfiguration", (Exception,), {})},
        "conan.tools": {},
        "conan.tools.build": {"can_run": lambda recipe: True},
        "conan.tools.cmake": {"CMake": Tool, "CMakeToolchain": Tool, "cmake_layout": noted("cmake_layout")},
        "conan.tools.files": {name: noted(name) for name in ("copy", "get", "rmdir")},
    }
    for name, members in content.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(members)


def check_conan(base, facts, folder):
    version, log = facts["version"], []
    conan_stand_in(log)
    folders = yaml.safe_load((base / "conan/config.yml").read_text())["versions"]
    want(folders == {version: {"folder": "all"}}, "conan: config.yml")
    recipe = runpy.run_path(str(base / "conan/all/conanfile.py"))["QuadwrightConan"]()
    runpy.run_path(str(base / "conan/all/test_package/conanfile.py"))
    for field in ("name", "description", "license", "url", "homepage", "topics", "package_type", "settings", "options", "default_options"):
        want(getattr(recipe, field, None), f"conan: no {field}")
    settings = types.SimpleNamespace(os="Linux", compiler="gcc")
    recipe.conan_data, recipe.version = yaml.safe_load((base / "conan/all/conandata.yml").read_text()), version
    recipe.settings, recipe.source_folder, recipe.package_folder = settings, "source", "package"
    recipe.options = types.SimpleNamespace(shared=True, fPIC=True, rm_safe=lambda name: None)
    properties = {}
    recipe.cpp_info = types.SimpleNamespace(set_property=properties.__setitem__)
    for step in (recipe.config_options, recipe.configure, recipe.layout, recipe.validate, recipe.source, recipe.generate, recipe.build, recipe.package, recipe.package_info):
        step()
    url, sha256 = source_of(facts, folder)
    want(("get", (), {"url": url, "sha256": sha256, "strip_root": True}) in log, "conan: source")
    want(properties["cmake_target_name"] == "quadwright::quadwright" and recipe.cpp_info.libs == ["quadwright"], "conan: package_info")
    want([entry[0] for entry in log if entry[0] in ("configure", "build", "install")] == ["configure", "build", "install"], "conan: build")


def check_homebrew(base, facts, folder):
    text = said(["ruby", str(HERE / "homebrew_stand_in.rb"), str(base / "homebrew/quadwright.rb")], "homebrew")
    if text is None:
        return
    formula = json.loads(text)
    url, sha256 = source_of(facts, folder)
    want((formula["url"], formula["sha256"]) == (url, sha256) and formula["class"] == "Quadwright", "homebrew: source")
    want(formula["test"] and formula["license"] == facts["licence"] and formula["homepage"] == facts["repository"], "homebrew: fields")
    want(len(formula["desc"]) < 80 and formula["install"][-1] == "cmake --install build", "homebrew: desc, install")


def check_nix(base, facts, folder):
    command = ["nix-instantiate", "--eval", "--strict", "--json", str(HERE / "nix_stand_in.nix"), "--argstr", "flake", str(base / "nix/flake.nix")]
    text = said(command, "nix")
    if text is None:
        return
    flake = json.loads(text)
    url, sha256 = source_of(facts, folder)
    want(flake["src"] == {"url": url, "sha256": sha256} and flake["version"] == facts["version"], "nix: source")
    want(flake["description"] == flake["meta"]["description"] == facts["description"] and flake["app"]["program"].endswith("/bin/quadwright"), "nix: fields")


# Of winget's schemas 1.10.0: what must be there, and a pattern for each.
WINGET = {
    "": {"PackageIdentifier": r"[^\s.]+(\.[^\s.]+)+", "PackageVersion": r"[^\\/:*?\"<>|]+", "DefaultLocale": "[a-z]{2}-[A-Z]{2}", "ManifestType": "version", "ManifestVersion": r"1\.10\.0"},
    ".installer": {"PackageIdentifier": ".+", "PackageVersion": ".+", "InstallerType": "zip", "NestedInstallerType": "portable", "NestedInstallerFiles": None, "Installers": None, "ManifestType": "installer", "ManifestVersion": r"1\.10\.0"},
    ".locale.en-US": {"PackageIdentifier": ".+", "PackageVersion": ".+", "PackageLocale": "en-US", "Publisher": ".{2,256}", "PackageName": ".{2,256}", "License": ".{3,512}", "ShortDescription": ".{3,256}", "PackageUrl": "https://.+", "ManifestType": "defaultLocale", "ManifestVersion": r"1\.10\.0"},
}


def check_winget(base, facts, folder):
    for part, rules in WINGET.items():
        manifest = yaml.safe_load((base / f"winget/Quadwright.Quadwright{part}.yaml").read_text())
        for field, pattern in rules.items():
            value = manifest.get(field)
            want(value and (pattern is None or re.fullmatch(pattern, str(value))), f"winget{part}: {field} is {value!r}")
        want((manifest["PackageIdentifier"], manifest["PackageVersion"]) == ("Quadwright.Quadwright", facts["version"]), f"winget{part}: identity")
        if part == ".installer":
            installer = manifest["Installers"][0]
            want(installer["Architecture"] == "x64" and installer["InstallerUrl"] == f"{facts['downloads']}/{facts['windows']}", "winget: installer")
            want(re.fullmatch("[0-9A-F]{64}", str(installer["InstallerSha256"])), "winget: InstallerSha256")


def check_aur(base, facts, folder):
    names = "pkgbase pkgdesc pkgver pkgrel url arch license makedepends depends source sha256sums"
    script = f"""set -e; . "$0"; declare -F build package > /dev/null; pkgbase=$pkgname; for name in {names}; do
        declare -n values=$name; for value in "${{values[@]}}"; do printf '%s = %s\\n' "$name" "$value"; done; done; printf '\\npkgname = %s\\n' "$pkgname" """
    text = said(["bash", "-c", script, str(base / "aur/PKGBUILD")], "aur")
    if text is not None:
        listed = (base / "aur/.SRCINFO").read_text()
        want(text == listed.replace("\t", ""), f".SRCINFO is not what PKGBUILD says:\n{text}")
    url, sha256 = source_of(facts, folder)
    want(f"source = {url}\n\tsha256sums = {sha256}\n" in (base / "aur/.SRCINFO").read_text(), "aur: source")


def check_bindings(facts):
    package = json.loads((ROOT / "bindings/web/package/package.json").read_text())
    want(package["publishConfig"] == {"access": "public", "provenance": True}, "npm: provenance wants publishConfig")
    want(package["repository"]["url"] == f"git+{facts['repository']}.git", "npm: provenance wants the repository that the workflow runs in")
    project = tomllib.loads((ROOT / "bindings/python/pyproject.toml").read_text())["project"]
    want({"name", "description", "readme", "license", "requires-python", "urls"} <= set(project), "PyPI: fields")
    jobs = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())["jobs"]
    for job, environment in (("pypi", "pypi"), ("npm", "npm")):
        want(jobs[job]["permissions"] == {"id-token": "write"} and jobs[job]["environment"] == environment, f"{job}: trusted publishing wants id-token and its environment")
    for name, job in jobs.items():
        want(set(job.get("needs", [])) <= set(jobs), f"release.yml: {name} needs what is not there")
    want({"pypi", "npm", "attach"} <= set(jobs), "release.yml: jobs")


def check(folder):
    facts = fill.about()
    base = folder / "packaging" if folder else HERE
    check_description(facts)
    for one in (check_conda, check_vcpkg, check_conan, check_homebrew, check_nix, check_winget, check_aur):
        one(base, facts, folder)
    check_bindings(facts)
    if folder and list(folder.glob("quadwright_remesh-*.zip")):
        for entry in json.loads((folder / "index.json").read_text())["data"]:
            name = entry["archive_url"].removeprefix(facts["downloads"] + "/")
            want(entry["archive_hash"] == "sha256:" + hashlib.sha256((folder / name).read_bytes()).hexdigest(), f"blender: {name}")


def install(folder, into):
    facts = fill.about()
    shutil.rmtree(into, ignore_errors=True)
    archive = folder / facts["source"]
    (into / "work").mkdir(parents=True)
    with tarfile.open(archive) as opened:
        opened.extractall(into / "work")
    script = 'set -e; . "$0"; srcdir=$PWD; pkgdir=$1; build; package'
    for command in (["bash", "-c", script, folder / "packaging/aur/PKGBUILD", into / "aur"],
                    ["cmake", f"-DARCHIVE_FILE={archive}", f"-DPORT_FOLDER={folder / 'packaging/vcpkg'}", f"-DPREFIX={into / 'vcpkg'}", f"-DWORK={into / 'vcpkg-work'}",
                     "-DLINKAGE=dynamic", "-P", HERE / "vcpkg_stand_in.cmake"]):
        (into / "vcpkg-work").mkdir(exist_ok=True)
        run = subprocess.run(command, cwd=into / "work", capture_output=True, text=True)
        want(run.returncode == 0, f"{command[0]}: {(run.stdout + run.stderr)[-3000:]}")
    for name in ("aur/usr/bin/quadwright", "aur/usr/share/licenses/quadwright/LICENSE", "vcpkg/tools/quadwright/quadwright", "vcpkg/include/quadwright/quadwright.h", "vcpkg/share/quadwright/copyright"):
        want((into / name).is_file(), f"nothing was installed as {name}")
    for name in ("aur/usr/bin/quadwright", "vcpkg/tools/quadwright/quadwright"):
        if (into / name).is_file():
            linked = subprocess.run(["ldd", into / name], capture_output=True, text=True).stdout
            want("cadical" not in linked, f"{name} is linked with this system's CaDiCaL")


if __name__ == "__main__":
    arguments = [pathlib.Path(word).resolve() if word != "--install" else word for word in sys.argv[1:]]
    if arguments[:1] == ["--install"] and len(arguments) == 3:
        install(*arguments[1:])
    elif len(arguments) <= 1 and "--install" not in arguments:
        check(arguments[0] if arguments else None)
    else:
        sys.exit(__doc__)
    for note in left_out:
        print("packaging: left out: " + note)
    if wrong:
        sys.exit("\n".join("packaging: " + sentence for sentence in wrong))
