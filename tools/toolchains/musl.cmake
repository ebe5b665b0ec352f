# Linux with musl for the C library, linked statically, by Debian's musl-tools and tools/musl-g++. With CaDiCaL, QW_MUSL_STUB is
# tools/musl_stub.c, compiled.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER musl-gcc)
set(CMAKE_CXX_COMPILER ${CMAKE_CURRENT_LIST_DIR}/../musl-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_C_STANDARD_LIBRARIES_INIT "${QW_MUSL_STUB}")
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH /usr/lib/x86_64-linux-musl)
