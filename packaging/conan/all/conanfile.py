import os

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir

required_conan_version = ">=2.0"


class QuadwrightConan(ConanFile):
    name = "quadwright"
    description = "Any triangle surface in, a clean all-quad mesh out"
    license = "MIT"
    url = "https://github.com/conan-io/conan-center-index"
    homepage = "https://github.com/quadwright/quadwright"
    topics = ("quad", "remesh", "retopology", "mesh", "geometry")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    default_options = {"shared": False, "fPIC": True}

    def config_options(self):
        if self.settings.os == "Windows":
            del self.options.fPIC

    def configure(self):
        if self.options.shared:
            self.options.rm_safe("fPIC")

    def layout(self):
        cmake_layout(self, src_folder="src")

    def validate(self):
        if self.settings.compiler == "msvc":
            raise ConanInvalidConfiguration("Quadwright is written for GCC and Clang")

    def source(self):
        get(self, **self.conan_data["sources"][self.version], strip_root=True)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["QW_BUILD_TESTS"] = False
        toolchain.cache_variables["QW_BUILD_SHARED"] = bool(self.options.shared)
        toolchain.cache_variables["QW_INSTALL_STATIC"] = False
        toolchain.cache_variables["QW_WITH_WEBP"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        copy(self, "LICENSE", os.path.join(self.source_folder, "carried", "cadical"), os.path.join(self.package_folder, "licenses", "cadical"))
        CMake(self).install()
        for folder in (os.path.join("lib", "cmake"), os.path.join("lib", "pkgconfig"), "share"):
            rmdir(self, os.path.join(self.package_folder, folder))

    def package_info(self):
        self.cpp_info.libs = ["quadwright"]
        self.cpp_info.set_property("cmake_file_name", "quadwright")
        self.cpp_info.set_property("cmake_target_name", "quadwright::quadwright")
        self.cpp_info.set_property("pkg_config_name", "quadwright")
        if self.settings.os == "Windows" and self.options.shared:
            self.cpp_info.defines = ["QW_SHARED"]
        if self.settings.os != "Windows":
            self.cpp_info.system_libs = ["m", "pthread"]
        if not self.options.shared:
            self.cpp_info.system_libs.append("c++" if self.settings.os == "Macos" else "stdc++")
