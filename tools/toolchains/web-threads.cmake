# As web.cmake, with memory that Workers share: for pages that are cross-origin isolated.
include(${CMAKE_CURRENT_LIST_DIR}/web.cmake)
set(CMAKE_C_FLAGS_INIT "-msimd128 -pthread")
set(CMAKE_CXX_FLAGS_INIT "-msimd128 -pthread")
set(QW_WEB_THREADS ON)
