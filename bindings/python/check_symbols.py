"""check_symbols.py FILE...: the oldest glibc that a wheel's or a library's symbols ask for, as a platform tag; refuses libraries that a Linux
system need not have. By objdump, as Debian has no auditwheel."""
import os
import re
import subprocess
import sys
import tempfile
import zipfile

ALLOWED = {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "librt.so.1", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


def tag(path):
    told = subprocess.run(["objdump", "-p", path], check=True, capture_output=True, text=True).stdout
    extra = set(re.findall(r"NEEDED +(\S+)", told)) - ALLOWED
    if extra:
        sys.exit(f"{path} needs {', '.join(sorted(extra))}")
    shown = subprocess.run(["objdump", "-T", path], check=True, capture_output=True, text=True).stdout
    others = set(re.findall(r"\b((?:GLIBCXX|CXXABI|GCC)_[0-9.]+)", shown))
    if others:
        sys.exit(f"{path} needs {', '.join(sorted(others))}")
    exported = [line.split()[-1] for line in shown.splitlines() if " g " in line and "*UND*" not in line]
    if exported != ["PyInit__native"]:
        sys.exit(f"{path} exports {', '.join(exported)}")
    versions = [tuple(map(int, v.split("."))) for v in re.findall(r"GLIBC_([0-9.]+)", shown)]
    major, minor = max(versions)[:2]
    return f"manylinux_{major}_{minor}_{os.uname().machine}"


def main(paths):
    for path in paths:
        if not path.endswith(".whl"):
            print(tag(path))
            continue
        with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(path) as wheel:
            for name in wheel.namelist():
                if name.endswith(".so"):
                    print(tag(wheel.extract(name, folder)))


main(sys.argv[1:])
