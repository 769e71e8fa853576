# `cpack` in the build folder: Debian packages, trocar (the program, its pages, its scenes) and trocar-dev (libraries and headers).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME trocar)
set(CPACK_PACKAGE_VENDOR "The Trocar developers")
set(CPACK_PACKAGE_CONTACT "The Trocar developers <trocar@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL trocar dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_TROCAR_PACKAGE_NAME trocar)
set(CPACK_DEBIAN_TROCAR_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TROCAR_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TROCAR_PACKAGE_DEPENDS tetgen) # it is run as a program
set(CPACK_DEBIAN_TROCAR_PACKAGE_RECOMMENDS "gnuplot-nox, libegl1, libgl1-mesa-dri, libosmesa6") # plots and pictures; all else goes without
set(CPACK_DEBIAN_DEV_PACKAGE_NAME trocar-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "libeigen3-dev, libfmt-dev, nlohmann-json3-dev, libpugixml-dev, zlib1g-dev, libpng-dev, libhwy-dev, libgmp-dev, libtbb-dev, libboost-dev")
set(CPACK_COMPONENT_TROCAR_DESCRIPTION "The program trocar, its pages, scenes and recipes.")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Libraries and headers for programs that step scenes: find_package(Trocar).")
# What is packed is what was built: `./start build` or `cmake --build BUILD --target trocar trocar-bench trocar_c` builds all of it, and no test is needed for it.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
include(CPack)
