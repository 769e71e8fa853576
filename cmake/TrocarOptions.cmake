# Compiler settings of every target. Bits must not depend on the machine: no -march=native, no fused
# multiply-add behind our back, no fast-math.
option(TROCAR_WERROR "Warnings are errors" OFF)
set(TROCAR_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=")

add_library(trocar_options INTERFACE)
target_compile_features(trocar_options INTERFACE cxx_std_20)
target_compile_options(trocar_options INTERFACE
    $<BUILD_INTERFACE:-Wall;-Wextra;-Wshadow;-Wnon-virtual-dtor;-Wno-psabi;-ffp-contract=off>
    # Members that a designated initialiser leaves out are meant to have their defaults; EXPECT_EQ after an if is no
    # dangling else; with sanitizers GCC takes more for uninitialised than is (its manual says so).
    $<BUILD_INTERFACE:$<$<BOOL:${TROCAR_WERROR}>:-Werror;-Wno-error=missing-field-initializers;-Wno-error=dangling-else;-Wno-error=maybe-uninitialized>>)
if(TROCAR_SANITIZE)
    target_compile_options(trocar_options INTERFACE
        $<BUILD_INTERFACE:-fsanitize=${TROCAR_SANITIZE};-fno-omit-frame-pointer;-O1;-g1>)
    target_link_options(trocar_options INTERFACE $<BUILD_INTERFACE:-fsanitize=${TROCAR_SANITIZE}>)
    if(TROCAR_SANITIZE MATCHES "undefined")
        target_compile_options(trocar_options INTERFACE $<BUILD_INTERFACE:-fno-sanitize-recover=undefined>)
    endif()
endif()

# A room of the house: every source in its folder (and the named sub-folders), headers beside them.
function(trocar_module name)
    cmake_parse_arguments(arg "" "" "DEPENDS;PRIVATE" ${ARGN})
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
    list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
    file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.hpp)
    if(sources)
        add_library(trocar_${name} STATIC ${sources} ${headers})
        set(scope PUBLIC)
        target_link_libraries(trocar_${name} PRIVATE ${arg_PRIVATE})
        target_precompile_headers(trocar_${name} PRIVATE <Eigen/Core> <array> <cstdint> <string> <vector>)
    else()
        add_library(trocar_${name} INTERFACE)
        set(scope INTERFACE)
    endif()
    add_library(Trocar::${name} ALIAS trocar_${name})
    set_target_properties(trocar_${name} PROPERTIES EXPORT_NAME ${name})
    target_include_directories(trocar_${name} ${scope}
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/trocar>)
    target_link_libraries(trocar_${name} ${scope} trocar_options ${arg_DEPENDS})
endfunction()

# One test program per folder of tests/: its sources, the modules it tests.
function(trocar_test name)
    cmake_parse_arguments(arg "" "TIMEOUT" "DEPENDS;LABELS" ${ARGN})
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
    if(NOT sources)
        return()
    endif()
    if(NOT arg_TIMEOUT)
        set(arg_TIMEOUT 300)
    endif()
    add_executable(test_${name} ${sources})
    target_link_libraries(test_${name} PRIVATE ${arg_DEPENDS} GTest::gmock GTest::gtest_main)
    target_precompile_headers(test_${name} PRIVATE <Eigen/Core> <gtest/gtest.h>)
    gtest_discover_tests(test_${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
        PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${name};${arg_LABELS}")
endfunction()
