# What `cmake --install` gives: libraries, <trocar.hpp> with the headers that it includes (under include/trocar), <c_api.h> beside it,
# the assets that scenes refer to, and a package: find_package(Trocar), targets Trocar::base ... Trocar::engine.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(modules base fem spheretree collision assets io time scene prepare state effects step fluoroscopy render report experiments)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Trocar)

set(targets trocar_options trocar_engine trocar_c)
foreach(module ${modules})
    list(APPEND targets trocar_${module})
endforeach()

# The public headers: engine/trocar.hpp and what it includes, and no other.
function(trocar_find_public_headers out)
    set(waiting engine/trocar.hpp)
    set(found "")
    while(waiting)
        list(POP_FRONT waiting header)
        if(header IN_LIST found OR NOT EXISTS ${PROJECT_SOURCE_DIR}/${header})
            continue()
        endif()
        list(APPEND found ${header})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
        file(STRINGS ${PROJECT_SOURCE_DIR}/${header} lines REGEX "^#include \"")
        foreach(line ${lines})
            string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included "${line}")
            list(APPEND waiting ${included})
        endforeach()
    endwhile()
    set(${out} ${found} PARENT_SCOPE)
endfunction()

trocar_find_public_headers(headers)
list(REMOVE_ITEM headers engine/trocar.hpp) # it stands above the folders
foreach(header ${headers})
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION include/trocar/${folder} COMPONENT dev)
endforeach()
install(FILES ${PROJECT_SOURCE_DIR}/engine/trocar.hpp DESTINATION include/trocar COMPONENT dev)
set_target_properties(trocar_options PROPERTIES EXPORT_NAME options)

install(TARGETS ${targets} EXPORT TrocarTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT trocar NAMELINK_COMPONENT dev
    PUBLIC_HEADER DESTINATION include/trocar COMPONENT dev)
install(EXPORT TrocarTargets NAMESPACE Trocar:: DESTINATION ${package_dir} COMPONENT dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets/recipes ${PROJECT_SOURCE_DIR}/assets/scenes ${PROJECT_SOURCE_DIR}/assets/sweeps
    DESTINATION ${CMAKE_INSTALL_DATADIR}/trocar COMPONENT trocar)
install(FILES ${PROJECT_SOURCE_DIR}/assets/scene.schema.json ${PROJECT_SOURCE_DIR}/assets/sweep.schema.json
    DESTINATION ${CMAKE_INSTALL_DATADIR}/trocar COMPONENT trocar)
# Pages keep their places relative to one another, and with them their links.
set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/trocar)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_SOURCE_DIR}/CONTRIBUTING.md ${PROJECT_SOURCE_DIR}/CITATION.cff
    ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${doc_dir} COMPONENT trocar)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${doc_dir} COMPONENT trocar PATTERN "*.py" EXCLUDE PATTERN "__pycache__" EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${doc_dir} COMPONENT dev PATTERN "__pycache__" EXCLUDE)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/TrocarConfig.cmake.in
    ${PROJECT_BINARY_DIR}/TrocarConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/TrocarConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/TrocarConfig.cmake ${PROJECT_BINARY_DIR}/TrocarConfigVersion.cmake
    DESTINATION ${package_dir} COMPONENT dev)
