"""Builds the library with CMake, and the extension around its archive. A source distribution carries the library along."""
import glob
import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.sdist import sdist
from wheel.bdist_wheel import bdist_wheel

HERE = pathlib.Path(__file__).resolve().parent
CARRIED = HERE / "library"  # in a source distribution
ROOT = CARRIED if (CARRIED / "CMakeLists.txt").exists() else HERE.parent.parent
LIBRARY = ["CMakeLists.txt", "LICENSE", "src", "include", "cli", "tools"]


def version():
    text = (ROOT / "include/quadwright/quadwright.h").read_text()
    return ".".join(re.search(f"QW_VERSION_{part} ([0-9]+)", text).group(1) for part in ("MAJOR", "MINOR", "PATCH"))


class BuildExtension(build_ext):
    """QUADWRIGHT_BUILD names the folder that the library is built in, to be used again; QUADWRIGHT_EXTENSION an extension that was
    built elsewhere, on an older system, and is packed as it is; QUADWRIGHT_SANITIZE the sanitizers to build with, such as address,undefined, and
    QUADWRIGHT_PRELOAD their libraries."""

    def build_extension(self, extension):
        target = pathlib.Path(self.get_ext_fullpath(extension.name))
        prebuilt = os.environ.get("QUADWRIGHT_EXTENSION")
        if prebuilt:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(prebuilt, target)
        else:
            self.link_library(extension)
            super().build_extension(extension)
        environment = dict(os.environ)
        if os.environ.get("QUADWRIGHT_SANITIZE"):  # the sanitizers' libraries come before all others
            environment.update(LD_PRELOAD=os.environ["QUADWRIGHT_PRELOAD"], ASAN_OPTIONS="detect_leaks=0")
        subprocess.run([sys.executable, str(HERE / "stubs.py"), str(target), str(target.parent)], check=True, env=environment)

    def link_library(self, extension):
        folder = pathlib.Path(os.environ.get("QUADWRIGHT_BUILD") or pathlib.Path(self.build_temp) / "library").resolve()
        sanitizers = os.environ.get("QUADWRIGHT_SANITIZE")
        flags = ["-DQW_BUILD_PYTHON=ON", "-DQW_BUILD_SHARED=OFF", "-DQW_BUILD_TOOL=OFF", "-DQW_BUILD_TESTS=OFF"]
        if sanitizers:
            flags.append(f"-DQW_SANITIZE={sanitizers}")
            extension.extra_compile_args += [f"-fsanitize={sanitizers}", "-g", "-fno-omit-frame-pointer"]
            extension.extra_link_args.append(f"-fsanitize={sanitizers}")
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        subprocess.run(["cmake", "-S", str(ROOT), "-B", str(folder), *generator, *flags], check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", str(folder), "--target", "quadwright_python", "-j", str(os.cpu_count() or 1)], check=True)
        extension.extra_objects += (folder / "python-link.txt").read_text().split()
        extension.depends += extension.extra_objects
        extension.include_dirs += [str(ROOT / "include"), str(ROOT / "src")]


class SourceDistribution(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        for name in LIBRARY:
            source, target = ROOT / name, pathlib.Path(base_dir) / "library" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)


class Wheel(bdist_wheel):
    """The tag says the oldest CPython, and QUADWRIGHT_PLATFORM the oldest system, such as manylinux_2_31_x86_64 (check_symbols.py)."""

    def finalize_options(self):
        self.py_limited_api = "cp311"
        super().finalize_options()

    def get_tag(self):
        python, abi, platform = super().get_tag()
        return python, abi, os.environ.get("QUADWRIGHT_PLATFORM") or platform


# What other modules in the process must not see stays inside, with C++'s library where it is an archive. macOS' linker keeps to what is exported.
LINK = ["-Wl,--exclude-libs,ALL", "-Wl,--gc-sections", "-static-libgcc", "-l:libstdc++.a", "-lm", "-lpthread"]
if sys.platform == "darwin":
    LINK = ["-Wl,-dead_strip", "-lc++"]

setup(
    version=version(),
    ext_modules=[
        Extension("quadwright._native", sorted(glob.glob("quadwright/_*.c")), py_limited_api=True, language="c",
                  extra_compile_args=["-std=c17", "-Wall", "-Wextra", "-fvisibility=hidden"],
                  extra_link_args=LINK)
    ],
    cmdclass={"build_ext": BuildExtension, "sdist": SourceDistribution, "bdist_wheel": Wheel},
)
