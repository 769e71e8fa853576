# Run by ctest: install, configure a stranger's project against the installed package only, build, run.
function(run what)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
    if(NOT status EQUAL 0)
        message(FATAL_ERROR "${what} failed (${status}):\n${output}")
    endif()
    set(last_output "${output}" PARENT_SCOPE)
endfunction()

function(build_project name source)
    run("configuring ${name}" ${CMAKE_COMMAND} -S ${source} -B ${WORK_DIR}/${name} -G ${GENERATOR}
        -DCMAKE_BUILD_TYPE=${CONFIG} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS}
        -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
        -DTrocar_DIR=${WORK_DIR}/prefix/${LIB_DIR}/cmake/Trocar)
    run("building ${name}" ${CMAKE_COMMAND} --build ${WORK_DIR}/${name} --parallel 2)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
run("installing" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
file(GLOB_RECURSE config RELATIVE ${WORK_DIR}/prefix ${WORK_DIR}/prefix/*/TrocarConfig.cmake)
string(REGEX REPLACE "/cmake/Trocar/TrocarConfig.cmake$" "" LIB_DIR "${config}")

# The public surface is small, and stays so: what trocar.hpp includes, and no other.
file(GLOB_RECURSE headers ${WORK_DIR}/prefix/include/*.hpp)
list(LENGTH headers header_count)
message(STATUS "${header_count} headers")
if(header_count EQUAL 0 OR header_count GREATER 30)
    message(FATAL_ERROR "${header_count} headers are installed, expected 1 to 30: ${headers}")
endif()

# Beside them what a user reads and calls: the program without debugging symbols, the manual page, completions, pages, scenes.
foreach(file bin/trocar share/man/man1/trocar.1 share/bash-completion/completions/trocar share/zsh/site-functions/_trocar share/doc/trocar/README.md
        include/trocar/c_api.h share/doc/trocar/docs/getting_started.md share/doc/trocar/LICENSE share/trocar/scenes/u_bend.json share/trocar/scene.schema.json)
    if(NOT EXISTS ${WORK_DIR}/prefix/${file})
        message(FATAL_ERROR "${file} is not installed")
    endif()
endforeach()
file(SIZE ${WORK_DIR}/prefix/bin/trocar installed_size)
file(SIZE ${BUILD_DIR}/trocar built_size)
message(STATUS "program: ${installed_size} bytes installed of ${built_size} built")
if(NOT installed_size LESS built_size)
    message(FATAL_ERROR "the installed program still has its debugging symbols")
endif()
run("asking the installed program" ${WORK_DIR}/prefix/bin/trocar --version)

# Nothing that is installed may point back into the source or the build folder.
file(GLOB_RECURSE package ${WORK_DIR}/prefix/${LIB_DIR}/cmake/Trocar/*.cmake)
foreach(file ${package})
    file(READ ${file} text)
    string(FIND "${text}" "${SOURCE_DIR}" found)
    if(NOT found EQUAL -1)
        message(FATAL_ERROR "${file} names the source folder")
    endif()
endforeach()

build_project(consumer ${SOURCE_DIR}/tests/install/consumer)
run("running the consumer" ${WORK_DIR}/consumer/consumer ${WORK_DIR}/prefix/share/trocar/scenes ${WORK_DIR}/consumer)
message(STATUS "consumer: ${last_output}")

file(GLOB examples ${SOURCE_DIR}/examples/*/CMakeLists.txt)
foreach(example ${examples})
    get_filename_component(folder ${example} DIRECTORY)
    get_filename_component(name ${folder} NAME)
    build_project(${name} ${folder})
    run("running ${name}" ${WORK_DIR}/${name}/${name} ${WORK_DIR}/prefix/share/trocar/scenes/straight_tube.json 20)
    message(STATUS "${name}: ${last_output}")
endforeach()
