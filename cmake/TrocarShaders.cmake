# Embeds shaders/*.glsl into a target; engine/render/shader_text.hpp reads them.
function(trocar_embed_shaders target)
    file(GLOB shaders CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/shaders/*.glsl)
    set(output ${CMAKE_CURRENT_BINARY_DIR}/shader_texts.cpp)
    add_custom_command(OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} "-DSHADERS=${shaders}"
                -P ${PROJECT_SOURCE_DIR}/cmake/embed_shaders.cmake
        DEPENDS ${shaders} ${PROJECT_SOURCE_DIR}/cmake/embed_shaders.cmake
        COMMENT "Embedding shaders" VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
