# WebAssembly for browsers and the npm package (bindings/web), by Debian's emscripten, whose linker needs NODE_PATH=/usr/share/nodejs in
# the environment. Vectors of 128 bits are in every browser since 2023. Its compiler makes wrong code of straight lines that it turns into
# vectors (-fslp-vectorize): the mean of four points had the last one's z in quad/protrusions.c, where bytes differed from the other platforms'.
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
set(QW_WEB_FLAGS "-msimd128 -fno-slp-vectorize")
set(CMAKE_C_FLAGS_INIT "${QW_WEB_FLAGS}")
set(CMAKE_CXX_FLAGS_INIT "${QW_WEB_FLAGS}")
