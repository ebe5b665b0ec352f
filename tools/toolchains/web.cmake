# WebAssembly for browsers and the npm package (bindings/web), by Debian's emscripten, whose linker needs NODE_PATH=/usr/share/nodejs in
# the environment. Vectors of 128 bits are in every browser since 2023.
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
set(CMAKE_C_FLAGS_INIT "-msimd128")
set(CMAKE_CXX_FLAGS_INIT "-msimd128")
# This compiler makes wrong code of straight lines that it turns into vectors: the mean of four points had the z of the last in
# remesh/quads/protrusions.c, so bytes differed from the other platforms'. An option, as it has to come after -O3, which switches that on.
add_compile_options(-fno-slp-vectorize)
