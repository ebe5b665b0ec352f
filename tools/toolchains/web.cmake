# WebAssembly for browsers and the npm package (bindings/web), by Debian's emscripten, whose linker needs NODE_PATH=/usr/share/nodejs in
# the environment. Vectors of 128 bits are in every browser since 2023; they change no result.
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
set(CMAKE_C_FLAGS_INIT "-msimd128")
set(CMAKE_CXX_FLAGS_INIT "-msimd128")
