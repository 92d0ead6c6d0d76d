# Target decant_version: "version.hpp", which says what was built, from which revision, how.

set(DECANT_VERSION_DIR ${PROJECT_BINARY_DIR}/generated)
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
string(STRIP "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type}} -ffp-contract=off -fno-math-errno -fno-trapping-math" flags)
if(DECANT_SANITIZE)
  string(APPEND flags " -fsanitize=${DECANT_SANITIZE}")
endif()
set(compiler "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}")
if(DECANT_HAS_CUDA)
  string(APPEND compiler ", nvcc ${CMAKE_CUDA_COMPILER_VERSION}")
endif()

# Runs in every build, because a commit or an edit changes the answer without touching a source
# this build knows; the header is rewritten only where it differs.
find_package(Git QUIET)
add_custom_target(decant_version_header
  COMMAND ${CMAKE_COMMAND}
    -D "git=${GIT_EXECUTABLE}" -D "source=${PROJECT_SOURCE_DIR}" -D "version=${PROJECT_VERSION}"
    -D "compiler=${compiler}" -D "flags=${flags}" -D "build_type=${CMAKE_BUILD_TYPE}"
    -D "template=${CMAKE_CURRENT_LIST_DIR}/version.hpp.in"
    -D "output=${DECANT_VERSION_DIR}/version.hpp"
    -P ${CMAKE_CURRENT_LIST_DIR}/WriteVersion.cmake
  BYPRODUCTS ${DECANT_VERSION_DIR}/version.hpp
  COMMENT "Checking the revision"
  VERBATIM)

add_library(decant_version INTERFACE)
add_dependencies(decant_version decant_version_header)
target_include_directories(decant_version INTERFACE ${DECANT_VERSION_DIR})
