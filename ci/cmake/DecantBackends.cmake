# decant_add_backends(NAME FOLDER HAS_CUDA [DEPENDS…]): an object library with all backends on every executor, from
# a folder that is gpu/ or a copy of it. nvcc compiles the files of backends/; for the host executor g++ compiles
# them again, each included by a file of one line.
function(decant_add_backends NAME FOLDER HAS_CUDA)
  file(GLOB backends RELATIVE ${PROJECT_SOURCE_DIR}/gpu CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/gpu/backends/*.cu)
  set(host_sources)
  foreach(backend IN LISTS backends)
    get_filename_component(name ${backend} NAME_WE)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${NAME}_host/${name}.cpp)
    file(CONFIGURE OUTPUT ${source} CONTENT "#include \"gpu/${backend}\"\n" @ONLY)
    list(APPEND host_sources ${source})
  endforeach()
  set_source_files_properties(${host_sources} PROPERTIES OBJECT_DEPENDS "${ARGN}")
  list(APPEND host_sources ${FOLDER}/core/host_algorithms.cpp ${FOLDER}/solver/host_device.cpp)
  set_source_files_properties(${host_sources} PROPERTIES
    COMPILE_DEFINITIONS "THRUST_DEVICE_SYSTEM=THRUST_DEVICE_SYSTEM_OMP;THRUST_HOST_SYSTEM=THRUST_HOST_SYSTEM_CPP")
  set(cuda_sources)
  if(HAS_CUDA)
    list(TRANSFORM backends PREPEND ${FOLDER}/ OUTPUT_VARIABLE cuda_sources)
    list(APPEND cuda_sources ${FOLDER}/core/cuda_algorithms.cu ${FOLDER}/ranks/nccl_exchange.cpp
      ${FOLDER}/solver/cuda_device.cu)
    set_source_files_properties(${FOLDER}/ranks/nccl_exchange.cpp PROPERTIES
      INCLUDE_DIRECTORIES "${CMAKE_CUDA_TOOLKIT_INCLUDE_DIRECTORIES}")
  endif()

  add_library(${NAME} OBJECT ${host_sources} ${cuda_sources})
  # A backend is a translation unit; newer CMakes would put several into one.
  set_target_properties(${NAME} PROPERTIES UNITY_BUILD OFF)
  target_compile_definitions(${NAME} PRIVATE DECANT_HAS_CUDA=${HAS_CUDA} DECANT_HAS_NCCL=${DECANT_HAS_NCCL})
  if(DECANT_SANITIZE)
    # Thrust's sorting binds references to null tags, which it never reads; AddressSanitizer still sees
    # what is read through null.
    target_compile_options(${NAME} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fno-sanitize=null>)
  endif()
  # g++ does not know nvcc's `#pragma unroll`.
  target_compile_options(${NAME} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-Wno-unknown-pragmas>
    "$<$<COMPILE_LANGUAGE:CUDA>:${DECANT_CUDA_FLAGS}>")
  target_include_directories(${NAME} SYSTEM PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:${DECANT_THRUST_INCLUDE_DIR}>)
  target_link_libraries(${NAME} PRIVATE decant_oracle_interface OpenMP::OpenMP_CXX)
  if(HAS_CUDA AND DECANT_HAS_NCCL)
    target_include_directories(${NAME} SYSTEM PRIVATE ${DECANT_NCCL_INCLUDE_DIR})
    target_link_libraries(${NAME} PRIVATE ${DECANT_NCCL_LIBRARY})
  endif()
endfunction()
