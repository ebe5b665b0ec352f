# What is installed, and the packages; included by CMakeLists.txt.
if(NOT QW_INSTALL)
  return()
endif()

# Components: runtime (tool, shared library) and devel (headers, archive, what finds them). Without --component both are installed.
if(QW_BUILD_TOOL)
  install(TARGETS quadwright COMPONENT runtime)
  install(FILES docs/man/quadwright.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
  install(FILES tools/completions/quadwright.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME quadwright COMPONENT runtime)
  install(FILES tools/completions/_quadwright DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT runtime)
  install(FILES tools/completions/quadwright.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT runtime)
endif()
install(TARGETS ${QW_TARGETS} EXPORT quadwright-targets
  RUNTIME COMPONENT runtime LIBRARY COMPONENT runtime NAMELINK_COMPONENT devel ARCHIVE COMPONENT devel)
install(DIRECTORY include/quadwright DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT devel)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME ${QW_LICENSE_NAME} COMPONENT runtime)
set(QW_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/quadwright)
install(EXPORT quadwright-targets NAMESPACE quadwright:: DESTINATION ${QW_PACKAGE_DIR} COMPONENT devel)
configure_package_config_file(tools/quadwright-config.cmake.in quadwright-config.cmake INSTALL_DESTINATION ${QW_PACKAGE_DIR})
write_basic_package_version_file(quadwright-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/quadwright-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/quadwright-config-version.cmake
  DESTINATION ${QW_PACKAGE_DIR} COMPONENT devel)
file(RELATIVE_PATH QW_PC_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(tools/quadwright.pc.in quadwright.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/quadwright.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT devel)
include(tools/packages.cmake)
