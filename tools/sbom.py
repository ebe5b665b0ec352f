"""usage: sbom.py VERSION: a list of the parts of what `make dist` hands out, as JSON of SPDX 2.3, on standard output: for each the package of this
system that it was taken from, its version and its licence. The same parts give the same text: the time is that of SOURCE_DATE_EPOCH or of the last commit."""
import hashlib
import json
import os
import subprocess
import sys
import time

# part: (Debian's package whose version is told, licence, what it is, where its source is); programs that only build are not parts.
PARTS = {
    "cadical": ("libcadical-dev", "MIT", "linked into programs, wheel and modules", "https://github.com/arminbiere/cadical"),
    "stb_image": ("libstb-dev", "MIT OR Unlicense", "textures of the input", "https://github.com/nothings/stb"),
    "libwebp": ("libwebp-dev", "BSD-3-Clause", "textures of the input that are WebP", "https://chromium.googlesource.com/webm/libwebp"),
    "glibc": ("libc6-dev", "LGPL-2.1-or-later", "linked into the static program for Linux", "https://sourceware.org/git/glibc.git"),
    "libstdc++": ("libstdc++-12-dev", "GPL-3.0-or-later WITH GCC-exception-3.1", "linked into programs and the wheel", "https://gcc.gnu.org"),
    "mingw-w64": ("mingw-w64-x86-64-dev", "ZPL-2.1", "linked into the program and library for Windows", "https://www.mingw-w64.org"),
    "emscripten": ("emscripten", "MIT OR NCSA", "its C library in the npm package's modules", "https://emscripten.org"),
}


def run(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout.strip()


def made():
    """When: seconds since 1970."""
    return int(os.environ.get("SOURCE_DATE_EPOCH") or run("git", "log", "-1", "--format=%ct") or 0)


def package(name, version, licence, summary, where):
    return {
        "SPDXID": "SPDXRef-" + name.replace("+", "x").replace("_", "-"),
        "name": name,
        "versionInfo": version,
        "downloadLocation": where,
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": "NOASSERTION",
        "summary": summary,
    }


def main(version):
    parts = {name: (run("dpkg-query", "-W", "-f", "${Version}", row[0]), row) for name, row in PARTS.items()}
    parts = {name: value for name, value in parts.items() if value[0]}  # what is not installed was not built with
    packages = [package("quadwright", version, "MIT", "any triangle surface in, a clean all-quad mesh out", "NOASSERTION")]
    packages += [package(name, found, licence, summary, where) for name, (found, (_, licence, summary, where)) in sorted(parts.items())]
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"quadwright-{version}",
        "creationInfo": {"created": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(made())), "creators": ["Tool: tools/sbom.py"]},
        "packages": packages,
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": packages[0]["SPDXID"]}]
        + [{"spdxElementId": packages[0]["SPDXID"], "relationshipType": "CONTAINS", "relatedSpdxElement": one["SPDXID"]} for one in packages[1:]],
    }
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
    document["documentNamespace"] = f"https://spdx.org/spdxdocs/quadwright-{version}-{digest[:16]}"
    print(json.dumps(document, indent=1))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
