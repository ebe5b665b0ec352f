#!/usr/bin/python3
"""usage: fill.py [--check | --release FOLDER]
Fills what channels say of Quadwright into their files, from about.toml and the version of quadwright.h: nothing but FIELDS below says which lines.
  --check           writes nothing; says what is not as it would be filled, and fails then
  --release FOLDER  writes nothing here; copies of packaging/ into FOLDER/packaging, with the hashes of what lies in FOLDER (tools/release)
Before a release nobody knows its hashes: they are zeros here."""
import hashlib
import pathlib
import re
import shutil
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
HERE = ROOT / "packaging"


def about():
    facts = tomllib.loads((HERE / "about.toml").read_text())
    header = (ROOT / "include/quadwright/quadwright.h").read_text()
    facts["version"] = ".".join(re.search(f"QW_VERSION_{part} ([0-9]+)", header).group(1) for part in ("MAJOR", "MINOR", "PATCH"))
    facts["downloads"] = f"{facts['repository']}/releases/download/v{facts['version']}"
    facts["source"] = f"quadwright-{facts['version']}-source.tar.gz"
    facts["windows"] = f"quadwright-{facts['version']}-windows-x86_64.zip"
    return facts


def digest(folder, name, kind):
    """Of a file of the release; zeros where there is none yet."""
    made = hashlib.new(kind)
    if folder is None:
        return "0" * (2 * made.digest_size)
    made.update((folder / name).read_bytes())
    return made.hexdigest()


def fields(facts, folder):
    """{file: [(what stands around the value, the value)]}: the group of the pattern is filled."""
    version, text, home = facts["version"], facts["description"], facts["repository"]
    url = f"{facts['downloads']}/{facts['source']}"
    sha256 = digest(folder, facts["source"], "sha256")
    yaml = {f"packaging/winget/Quadwright.Quadwright{part}.yaml": [("(?m)^PackageVersion: (.*)$", version)] for part in ("", ".installer", ".locale.en-US")}
    yaml["packaging/winget/Quadwright.Quadwright.installer.yaml"] += [
        (r"RelativeFilePath: (.*)\\quadwright.exe", facts["windows"].removesuffix(".zip")),
        ("InstallerUrl: (.*)", f"{facts['downloads']}/{facts['windows']}"),
        ('InstallerSha256: "(.*)"', digest(folder, facts["windows"], "sha256").upper()),
    ]
    yaml["packaging/winget/Quadwright.Quadwright.locale.en-US.yaml"] += [
        ("Publisher: (.*)", facts["authors"]),
        ("PublisherUrl: (.*)", home),
        ("PublisherSupportUrl: (.*)", home + "/issues"),
        ("PackageName: (.*)", facts["title"]),
        ("PackageUrl: (.*)", home),
        ("License: (.*)", facts["licence"]),
        ("LicenseUrl: (.*)", home + "/blob/main/LICENSE"),
        ("ShortDescription: (.*)", text),
    ]
    return yaml | {
        "packaging/conda/recipe.yaml": [
            ('version: "(.*)"', version),
            (r"\n  url: (.*)", url.replace(version, "${{ version }}")),
            ('sha256: "(.*)"', sha256),
            ("homepage: (.*)", home),
            ("repository: (.*)", home),
            ("summary: (.*)", text),
            (r"recipe-maintainers:\n    - (.*)", facts["owner"]),
        ],
        "packaging/vcpkg/portfile.cmake": [('URLS "(.*)"', url.replace(version, "${VERSION}")), ("SHA512 (.*)", digest(folder, facts["source"], "sha512"))],
        "packaging/vcpkg/vcpkg.json": [('"version": "(.*)"', version), ('\n  "description": "(.*)"', text), ('"homepage": "(.*)"', home)],
        "packaging/conan/config.yml": [('\n  "(.*)":', version)],
        "packaging/conan/all/conandata.yml": [('\n  "(.*)":', version), ('url: "(.*)"', url), ('sha256: "(.*)"', sha256)],
        "packaging/conan/all/conanfile.py": [('description = "(.*)"', text), ('homepage = "(.*)"', home)],
        "packaging/homebrew/quadwright.rb": [
            (r"a tap \((.*)/homebrew-tap\)", facts["owner"]),
            ('desc "(.*)"', text),
            ('homepage "(.*)"', home),
            ('\n  url "(.*)"', url),
            ('sha256 "(.*)"', sha256),
        ],
        "packaging/nix/flake.nix": [
            (r"github:(.*)\?dir", home.removeprefix("https://github.com/")),
            ('\n  description = "(.*)"', text),
            ('  version = "(.*)"', version),
            ('\n          url = "(.*)"', url),
            ('sha256 = "(.*)"', sha256),
            ('\n          description = "(.*)"', text),
            ('homepage = "(.*)"', home),
        ],
        "packaging/aur/PKGBUILD": [
            ("Maintainer: (.*)", facts["authors"]),
            ("pkgver=(.*)", version),
            ('pkgdesc="(.*)"', text),
            ('\nurl="(.*)"', home),
            (r'source=\("(.*)"\)', url.replace(version, "$pkgver")),
            (r"sha256sums=\('(.*)'\)", sha256),
        ],
        "packaging/aur/.SRCINFO": [
            ("pkgdesc = (.*)", text),
            ("pkgver = (.*)", version),
            ("\turl = (.*)", home),
            ("source = (.*)", url),
            ("sha256sums = (.*)", sha256),
        ],
        "bindings/python/pyproject.toml": [('\ndescription = "(.*)"', text), ('\nRepository = "(.*)"', home), ('\nIssues = "(.*)"', home + "/issues")],
        "bindings/python/server.json": [
            ('\n  "name": "io.github.(.*)/quadwright"', facts["owner"]),
            ('\n  "version": "(.*)"', version),
            ('\n      "version": "(.*)"', version),
            ('"url": "([^"]*)"', home),
        ],
        "bindings/python/README.md": [("mcp-name: io.github.(.*)/quadwright", facts["owner"])],
        "bindings/comfyui/pyproject.toml": [
            ('\nversion = "(.*)"', version),
            (r'dependencies = \["quadwright==(.*)"\]', version),
            ('Repository = "(.*)"', home),
            ('PublisherId = "(.*)"', facts["owner"]),
        ],
        "bindings/comfyui/requirements.txt": [("quadwright==(.*)", version)],
        "bindings/freecad/Quadwright/package.xml": [("<version>(.*)</version>", version), ('<url type="repository" branch="main">(.*)</url>', home)],
        "bindings/web/package/package.json": [
            ('"version": "(.*)"', version),
            ('"description": "(.*)"', text),
            ('"homepage": "(.*)"', home + "#readme"),
            (r'"repository": {[^}]*"url": "([^"]*)"', f"git+{home}.git"),
            (r'"bugs": "(.*)"', home + "/issues"),
        ],
        "bindings/blender/quadwright_remesh/blender_manifest.toml": [('tagline = "(.*)"', text), ('website = "(.*)"', home)],
        "bindings/blender/quadwright_remesh/__init__.py": [(r'"version": \((.*)\)', version.replace(".", ", ")), ('"description": "(.*)"', text), ('"doc_url": "(.*)"', home)],
        "tools/packages.cmake": [('CPACK_PACKAGE_DESCRIPTION_SUMMARY "(.*)"', text), ('CPACK_PACKAGE_HOMEPAGE_URL "(.*)"', home)],
        "CITATION.cff": [("\nversion: (.*)", version), ("\nrepository-code: (.*)", home)],
    }


def filled(name, values):
    """The file's text with its values; every pattern stands in it exactly once."""
    text = (ROOT / name).read_text()
    for pattern, value in values:
        found = list(re.finditer(pattern, text, re.MULTILINE))
        if len(found) != 1:
            raise SystemExit(f"fill.py: {name}: {pattern!r} is there {len(found)} times")
        begin, end = found[0].span(1)
        text = text[:begin] + value + text[end:]
    return text


def main(arguments):
    folder = pathlib.Path(arguments[1]) if arguments[:1] == ["--release"] and len(arguments) == 2 else None
    if arguments not in ([], ["--check"]) and folder is None:
        raise SystemExit(__doc__)
    stale = []
    if folder:
        shutil.copytree(HERE, folder / "packaging", dirs_exist_ok=True, ignore=shutil.ignore_patterns("fill.py", "check.py", "*_stand_in.*", "__pycache__", "about.toml"))
    for name, values in fields(about(), folder).items():
        text = filled(name, values)
        if folder:
            if name.startswith("packaging/"):
                (folder / name).write_text(text)
        elif text != (ROOT / name).read_text():
            stale.append(name)
            if not arguments:
                (ROOT / name).write_text(text)
    if arguments == ["--check"] and stale:
        raise SystemExit(f"fill.py: not as packaging/fill.py fills them: {', '.join(stale)}")


if __name__ == "__main__":
    main(sys.argv[1:])
