# Compiler settings of every target. Bits must not depend on the machine: no -march=native, no fused
# multiply-add behind our back, no fast-math.
option(TROCAR_WERROR "Warnings are errors" OFF)
set(TROCAR_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=")

add_library(trocar_options INTERFACE)
target_compile_features(trocar_options INTERFACE cxx_std_20)
target_compile_options(trocar_options INTERFACE
    $<BUILD_INTERFACE:-Wall;-Wextra;-Wshadow;-Wnon-virtual-dtor;-Wno-psabi;-ffp-contract=off>
    # Members that a designated initialiser leaves out are meant to have their defaults; EXPECT_EQ after an if is no
    # dangling else; with sanitizers GCC takes more for uninitialised than is (its manual says so); a file that a unity build includes may
    # have an anonymous namespace.
    $<BUILD_INTERFACE:$<$<BOOL:${TROCAR_WERROR}>:-Werror;-Wno-error=missing-field-initializers;-Wno-error=dangling-else;-Wno-error=maybe-uninitialized;-Wno-error=subobject-linkage>>)
if(TROCAR_SANITIZE)
    # Vector kernels for one instruction set instead of four, and with calls for their checks: less to compile. It needs a processor with AVX2 (Highway asks for AES and PCLMUL, too, else its kernels are scalar).
    target_compile_options(trocar_options INTERFACE
        $<BUILD_INTERFACE:-fsanitize=${TROCAR_SANITIZE};-fno-omit-frame-pointer;-O1;-g1;-march=x86-64-v3;-maes;-mpclmul>)
    target_compile_definitions(trocar_options INTERFACE $<BUILD_INTERFACE:HWY_COMPILE_ONLY_STATIC>)
    if(TROCAR_SANITIZE MATCHES "address")
        target_compile_options(trocar_options INTERFACE $<BUILD_INTERFACE:--param=asan-instrumentation-with-call-threshold=0>)
    endif()
    target_link_options(trocar_options INTERFACE $<BUILD_INTERFACE:-fsanitize=${TROCAR_SANITIZE}>)
    if(TROCAR_SANITIZE MATCHES "undefined")
        target_compile_options(trocar_options INTERFACE $<BUILD_INTERFACE:-fno-sanitize-recover=undefined>)
    endif()
endif()

# Sources are compiled some at a time, folder by folder: most of a file's time goes into what it includes. Files with
# Highway's foreach_target include themselves and stay alone. OFF: each file alone, for work on few of them.
option(TROCAR_UNITY "Compile several sources at a time" ON)
set(TROCAR_UNITY_FILES 8 CACHE STRING "How many at a time")
function(trocar_group_sources target)
    if(NOT TROCAR_UNITY)
        return()
    endif()
    set(count 0)
    set(last "")
    foreach(source ${ARGN})
        get_filename_component(folder ${source} DIRECTORY)
        if(source MATCHES "_kernels\\.cpp$" OR source MATCHES "/near_pairs\\.cpp$")
            continue()
        endif()
        if(NOT folder STREQUAL last)
            set(last ${folder})
            set(count 0)
        endif()
        math(EXPR group "${count} / ${TROCAR_UNITY_FILES}")
        math(EXPR count "${count} + 1")
        file(RELATIVE_PATH place ${PROJECT_SOURCE_DIR} ${folder})
        string(MAKE_C_IDENTIFIER "${place}_${group}" id)
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${id})
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# A module: every source in its folder and sub-folders, headers beside them. IN: the folder, where it has not the CMakeLists.
function(trocar_module name)
    cmake_parse_arguments(arg "" "IN" "DEPENDS;PRIVATE" ${ARGN})
    set(folder ${CMAKE_CURRENT_SOURCE_DIR})
    if(arg_IN)
        set(folder ${folder}/${arg_IN})
    endif()
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${folder}/*.cpp)
    list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
    file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${folder}/*.hpp)
    add_library(trocar_${name} STATIC ${sources} ${headers})
    trocar_group_sources(trocar_${name} ${sources})
    target_link_libraries(trocar_${name} PRIVATE ${arg_PRIVATE} PUBLIC trocar_options ${arg_DEPENDS})
    target_precompile_headers(trocar_${name} PRIVATE <Eigen/Core> <array> <cstdint> <string> <vector>)
    add_library(Trocar::${name} ALIAS trocar_${name})
    set_target_properties(trocar_${name} PROPERTIES EXPORT_NAME ${name})
    target_include_directories(trocar_${name} PUBLIC
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/trocar>)
endfunction()

# One test program per folder of tests/: its sources, the modules it tests.
function(trocar_test name)
    cmake_parse_arguments(arg "SEPARATE" "TIMEOUT" "DEPENDS;LABELS" ${ARGN})
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
    if(NOT sources)
        return()
    endif()
    if(NOT arg_TIMEOUT)
        set(arg_TIMEOUT 300)
    endif()
    add_executable(test_${name} ${sources})
    if(NOT arg_SEPARATE) # SEPARATE: files whose names for their own use are the same
        trocar_group_sources(test_${name} ${sources})
    endif()
    target_link_libraries(test_${name} PRIVATE ${arg_DEPENDS} GTest::gmock GTest::gtest_main)
    target_precompile_headers(test_${name} PRIVATE <Eigen/Core> <gtest/gtest.h>)
    gtest_discover_tests(test_${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
        PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${name};${arg_LABELS}")
endfunction()
