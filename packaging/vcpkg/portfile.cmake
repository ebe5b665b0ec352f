# ports/quadwright of microsoft/vcpkg, or an overlay: vcpkg install quadwright --overlay-ports=packaging/vcpkg
vcpkg_download_distfile(ARCHIVE
    URLS "https://github.com/quadwright/quadwright/releases/download/v${VERSION}/quadwright-${VERSION}-source.tar.gz"
    FILENAME "quadwright-${VERSION}-source.tar.gz"
    SHA512 00000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000
)
vcpkg_extract_source_archive(SOURCE_PATH ARCHIVE "${ARCHIVE}")

string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "dynamic" SHARED)
vcpkg_check_features(OUT_FEATURE_OPTIONS CHOICES
    FEATURES
        tools QW_BUILD_TOOL
        webp  QW_WITH_WEBP
)
vcpkg_cmake_configure(
    SOURCE_PATH "${SOURCE_PATH}"
    OPTIONS
        -DQW_BUILD_TESTS=OFF
        -DQW_BUILD_SHARED=${SHARED}
        -DQW_INSTALL_STATIC=OFF
        ${CHOICES}
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/quadwright)
vcpkg_fixup_pkgconfig()
if("tools" IN_LIST FEATURES)
    vcpkg_copy_tools(TOOL_NAMES quadwright AUTO_CLEAN)
endif()
file(REMOVE_RECURSE
    "${CURRENT_PACKAGES_DIR}/debug/include"
    "${CURRENT_PACKAGES_DIR}/debug/share"
    "${CURRENT_PACKAGES_DIR}/share/doc"
)
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE" "${SOURCE_PATH}/carried/cadical/LICENSE")
