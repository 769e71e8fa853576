# Embeds files of text into a target: trocar_embed_texts(trocar_render shaders/*.glsl engine/render/shader_text.hpp ShaderText shader_texts)
function(trocar_embed_texts target pattern header type function)
    file(GLOB texts CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${pattern})
    set(output ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
    set(script ${PROJECT_SOURCE_DIR}/cmake/embed_texts.cmake)
    add_custom_command(OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} "-DTEXTS=${texts}" -DHEADER=${header} -DTYPE=${type} -DFUNCTION=${function} -P ${script}
        DEPENDS ${texts} ${script}
        COMMENT "Embedding ${pattern}" VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
