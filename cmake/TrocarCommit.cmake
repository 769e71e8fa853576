# Gives a program kTrocarCommit. Made anew when HEAD moves, and not otherwise: only the program is linked again.
function(trocar_name_commit target)
    set(output ${CMAKE_CURRENT_BINARY_DIR}/commit.cpp)
    set(moves "")
    foreach(log .git/logs/HEAD .git/HEAD)
        if(EXISTS ${PROJECT_SOURCE_DIR}/${log})
            list(APPEND moves ${PROJECT_SOURCE_DIR}/${log})
        endif()
    endforeach()
    add_custom_command(OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DSOURCE=${PROJECT_SOURCE_DIR} -P ${PROJECT_SOURCE_DIR}/cmake/commit.cmake
        DEPENDS ${moves} ${PROJECT_SOURCE_DIR}/cmake/commit.cmake COMMENT "Asking for the commit" VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
