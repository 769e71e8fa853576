# What `cmake --install` gives: libraries, headers under include/seldinger so that "engine/..." and "base/..." resolve,
# the assets that scenes refer to, and a package: find_package(Seldinger), targets Seldinger::base ... Seldinger::engine.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(rooms base fem spheretree collision assets engine)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Seldinger)

set(targets seldinger_options)
foreach(room ${rooms})
    list(APPEND targets seldinger_${room})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${room} DESTINATION include/seldinger FILES_MATCHING PATTERN "*.hpp")
endforeach()
set_target_properties(seldinger_options PROPERTIES EXPORT_NAME options)

install(TARGETS ${targets} EXPORT SeldingerTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT SeldingerTargets NAMESPACE Seldinger:: DESTINATION ${package_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets/recipes ${PROJECT_SOURCE_DIR}/assets/scenes
    DESTINATION ${CMAKE_INSTALL_DATADIR}/seldinger)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/SeldingerConfig.cmake.in
    ${PROJECT_BINARY_DIR}/SeldingerConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/SeldingerConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/SeldingerConfig.cmake ${PROJECT_BINARY_DIR}/SeldingerConfigVersion.cmake
    DESTINATION ${package_dir})
