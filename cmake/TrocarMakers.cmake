# Gives a target maker_version(): a hash of the sources of the folders that make what engine/prepare caches, and of the readers
# in engine/io, through which TetGen's meshes and a patient's volumes come.
function(trocar_hash_makers target)
    set(sources "")
    foreach(folder ${ARGN} engine/io)
        file(GLOB_RECURSE found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp ${PROJECT_SOURCE_DIR}/${folder}/*.hpp)
        list(APPEND sources ${found})
    endforeach()
    set(output ${CMAKE_CURRENT_BINARY_DIR}/maker_version.cpp)
    add_custom_command(OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} "-DSOURCES=${sources}" -P ${PROJECT_SOURCE_DIR}/cmake/hash_sources.cmake
        DEPENDS ${sources} ${PROJECT_SOURCE_DIR}/cmake/hash_sources.cmake
        COMMENT "Hashing the sources of cached meshes" VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
