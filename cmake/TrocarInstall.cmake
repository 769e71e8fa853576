# What `cmake --install` gives: libraries, headers under include/trocar so that "engine/..." and "base/..." resolve,
# the assets that scenes refer to, and a package: find_package(Trocar), targets Trocar::base ... Trocar::engine.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(folders base fem spheretree collision assets engine)
set(modules base fem spheretree collision assets io time scene prepare state step render report experiments)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Trocar)

set(targets trocar_options trocar_engine)
foreach(module ${modules})
    list(APPEND targets trocar_${module})
endforeach()
foreach(folder ${folders})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION include/trocar FILES_MATCHING PATTERN "*.hpp"
        PATTERN engine/viewer EXCLUDE PATTERN engine/cli EXCLUDE)
endforeach()
set_target_properties(trocar_options PROPERTIES EXPORT_NAME options)

install(TARGETS ${targets} EXPORT TrocarTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT TrocarTargets NAMESPACE Trocar:: DESTINATION ${package_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets/recipes ${PROJECT_SOURCE_DIR}/assets/scenes
    DESTINATION ${CMAKE_INSTALL_DATADIR}/trocar)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/TrocarConfig.cmake.in
    ${PROJECT_BINARY_DIR}/TrocarConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/TrocarConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/TrocarConfig.cmake ${PROJECT_BINARY_DIR}/TrocarConfigVersion.cmake
    DESTINATION ${package_dir})
