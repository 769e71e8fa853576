# The page of `trocar view`: one HTML file beside the program, made with node from engine/viewer/page. A target of its own,
# since its packages come from npm's registry and the program works without it.
set(page_sources ${PROJECT_SOURCE_DIR}/engine/viewer/page)
set(page_build ${PROJECT_BINARY_DIR}/page_build)
file(GLOB_RECURSE page_files CONFIGURE_DEPENDS ${page_sources}/src/*)
find_program(TROCAR_NODE NAMES node nodejs)
find_program(TROCAR_NPM NAMES npm)

if(TROCAR_NODE AND TROCAR_NPM)
    add_custom_command(OUTPUT ${page_build}/node_modules/.package-lock.json
        COMMAND ${CMAKE_COMMAND} -E make_directory ${page_build}
        COMMAND ${CMAKE_COMMAND} -E copy ${page_sources}/package.json ${page_sources}/package-lock.json ${page_sources}/.npmrc ${page_build}
        COMMAND ${TROCAR_NPM} ci --no-progress --loglevel=error
        DEPENDS ${page_sources}/package.json ${page_sources}/package-lock.json ${page_sources}/.npmrc
        WORKING_DIRECTORY ${PROJECT_BINARY_DIR}/page_build
        COMMENT "Fetching the page's packages" VERBATIM)
    file(MAKE_DIRECTORY ${page_build})
    add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/page/index.html
        COMMAND ${CMAKE_COMMAND} -E rm -rf ${page_build}/src
        COMMAND ${CMAKE_COMMAND} -E copy_directory ${page_sources}/src ${page_build}/src
        COMMAND ${CMAKE_COMMAND} -E copy ${page_sources}/build.mjs ${page_sources}/tsconfig.json ${page_build}
        COMMAND ${TROCAR_NODE} build.mjs ${PROJECT_BINARY_DIR}/page/index.html
        DEPENDS ${page_files} ${page_sources}/build.mjs ${page_sources}/tsconfig.json ${page_build}/node_modules/.package-lock.json
        WORKING_DIRECTORY ${page_build}
        COMMENT "Building the page" VERBATIM)
    add_custom_target(viewer_page DEPENDS ${PROJECT_BINARY_DIR}/page/index.html)
else()
    add_custom_target(viewer_page
        COMMAND ${CMAKE_COMMAND} -E echo "The page of trocar view needs node and npm: apt-get install nodejs npm, configure again"
        COMMAND ${CMAKE_COMMAND} -E false VERBATIM)
endif()
install(FILES ${PROJECT_BINARY_DIR}/page/index.html DESTINATION ${CMAKE_INSTALL_DATADIR}/trocar/page COMPONENT trocar OPTIONAL)
