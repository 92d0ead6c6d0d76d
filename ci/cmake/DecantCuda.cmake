# Decides whether the cuda executor is built, for which GPUs, and which Thrust the host executor
# uses. Sets DECANT_HAS_CUDA (0 or 1), DECANT_CUDA_FLAGS, DECANT_THRUST_INCLUDE_DIR and DECANT_HAS_NCCL (0 or 1).

set(DECANT_HAS_CUDA 0)

if(NOT DECANT_CUDA STREQUAL "OFF")
  # Installers leave nvcc off the PATH. Given through the environment, because check_language takes
  # a compiler that is set already for one that works.
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    find_program(DECANT_NVCC nvcc HINTS ENV CUDA_HOME ENV CUDA_PATH PATH_SUFFIXES bin
      PATHS /usr/local/cuda/bin)
    mark_as_advanced(DECANT_NVCC)
    if(DECANT_NVCC)
      set(ENV{CUDACXX} ${DECANT_NVCC})
    endif()
  endif()
  include(CheckLanguage)
  check_language(CUDA)

  if(CMAKE_CUDA_COMPILER)
    if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
      execute_process(COMMAND ${CMAKE_CUDA_COMPILER} --list-gpu-arch OUTPUT_VARIABLE supported)
      set(architectures)
      # Code for 80 runs on 86 and 89 as well.
      foreach(architecture 75 80)
        if(supported MATCHES "compute_${architecture}[^0-9]")
          list(APPEND architectures ${architecture}-real)
        endif()
      endforeach()
      # With PTX of the last one, which later GPUs compile for themselves.
      list(APPEND architectures 90)
      set(CMAKE_CUDA_ARCHITECTURES "${architectures}" CACHE STRING "GPUs to build for")
    endif()
    enable_language(CUDA)
    set(DECANT_HAS_CUDA 1)
  elseif(DECANT_CUDA STREQUAL "ON")
    message(FATAL_ERROR "DECANT_CUDA=ON, but no working CUDA compiler was found; put nvcc on the "
      "PATH or set CMAKE_CUDA_COMPILER.")
  endif()
endif()

if(DECANT_HAS_CUDA)
  set(CMAKE_CUDA_STANDARD 20)
  set(CMAKE_CUDA_STANDARD_REQUIRED ON)
  set(CMAKE_CUDA_EXTENSIONS OFF)
  # Debian 12's CMake 3.25.1 does not know how nvcc is told about C++20.
  if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
    set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
    set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION -std=c++20)
  endif()
  set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
  set(DECANT_CUDA_FLAGS --expt-relaxed-constexpr --extended-lambda --threads 0 --ftz=true
    --prec-div=false --prec-sqrt=false)
  # nvcc's -O is of host code, which in these files starts kernels: to optimize it takes a third of the time and
  # gains nothing. Device code is optimized whatever it says.
  string(REPLACE -O3 -O1 CMAKE_CUDA_FLAGS_RELEASE "${CMAKE_CUDA_FLAGS_RELEASE}")
  # One binary must not mix two versions of Thrust, so the host executor takes the toolkit's.
  find_path(DECANT_THRUST_INCLUDE_DIR thrust/version.h NO_DEFAULT_PATH
    HINTS ${CMAKE_CUDA_TOOLKIT_INCLUDE_DIRECTORIES} PATH_SUFFIXES cccl .)
  message(STATUS "Executors: host, cuda (nvcc ${CMAKE_CUDA_COMPILER_VERSION}, architectures "
    "${CMAKE_CUDA_ARCHITECTURES})")
else()
  find_path(DECANT_THRUST_INCLUDE_DIR thrust/version.h)
  message(STATUS "Executors: host")
endif()
mark_as_advanced(DECANT_THRUST_INCLUDE_DIR)
if(NOT DECANT_THRUST_INCLUDE_DIR)
  message(FATAL_ERROR "Thrust is missing (Debian and Ubuntu: libthrust-dev, or a CUDA toolkit).")
endif()

# Ranks on GPUs exchange by NCCL where it is found, else through host memory.
set(DECANT_HAS_NCCL 0)
if(DECANT_HAS_CUDA)
  find_path(DECANT_NCCL_INCLUDE_DIR nccl.h HINTS ENV NCCL_HOME PATH_SUFFIXES include)
  find_library(DECANT_NCCL_LIBRARY NAMES nccl libnccl.so.2 HINTS ENV NCCL_HOME PATH_SUFFIXES lib lib64)
  mark_as_advanced(DECANT_NCCL_INCLUDE_DIR DECANT_NCCL_LIBRARY)
  if(DECANT_NCCL_INCLUDE_DIR AND DECANT_NCCL_LIBRARY)
    set(DECANT_HAS_NCCL 1)
  else()
    message(STATUS "No NCCL: ranks on GPUs exchange through host memory")
  endif()
endif()
