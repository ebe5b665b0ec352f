# WebAssembly for Node, by Debian's emscripten, whose linker needs NODE_PATH=/usr/share/nodejs in the environment. The programs see the
# machine's own files.
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-sNODERAWFS=1 -sALLOW_MEMORY_GROWTH=1 -sMAXIMUM_MEMORY=4GB -sEXIT_RUNTIME=1")
