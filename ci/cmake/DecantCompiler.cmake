# How every target is compiled: with which compilers, warnings, exact arithmetic, sanitizers.

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 12)
  message(FATAL_ERROR "Decant needs g++ 12 or later (C++20); ${CMAKE_CXX_COMPILER} is "
    "${CMAKE_CXX_COMPILER_VERSION}. Name another: -D CMAKE_CXX_COMPILER=g++-12")
endif()

# Warnings of Decant's own sources. Pedantic ones are for g++ and clang alone, because what nvcc
# hands to the host compiler is not pedantic C++.
add_library(decant_warnings INTERFACE)
target_compile_options(decant_warnings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    -Wcast-qual>
  # False alarms of g++'s optimizer, on std::string (GCC bug 105651) and on std::optional.
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-restrict -Wno-maybe-uninitialized>
  $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra>)
if(DECANT_WERROR)
  target_compile_options(decant_warnings INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-Werror> $<$<COMPILE_LANGUAGE:CUDA>:--Werror=all-warnings>)
endif()

# The oracle's arithmetic must not depend on whether the processor has fused multiply-add, nor on
# which user's copy of an inline function the linker keeps: whoever links the model gets this.
# errno and floating-point traps, which nobody reads, would only keep the compiler from reordering.
add_library(decant_exact_arithmetic INTERFACE)
target_compile_options(decant_exact_arithmetic INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off -fno-math-errno -fno-trapping-math>)

if(DECANT_SANITIZE)
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${DECANT_SANITIZE}>
    $<$<COMPILE_LANGUAGE:CXX>:-fno-sanitize-recover=all>
    $<$<COMPILE_LANGUAGE:CXX>:-fno-omit-frame-pointer>)
  add_link_options(-fsanitize=${DECANT_SANITIZE})
endif()
