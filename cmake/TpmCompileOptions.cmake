# Compile options of our own code only; dependencies come in as system headers.
# Whoever only uses the program is not shown warnings; scripts/check.sh turns them on, as errors.
option(TPM_WARNINGS "Ask the compiler for its warnings" OFF)
add_library(tpm_options INTERFACE)
if(TPM_WARNINGS)
  target_compile_options(tpm_options INTERFACE -Wall -Wextra -Wconversion -Wshadow
    $<$<BOOL:${TPM_WARNINGS_AS_ERRORS}>:-Werror>)
else()
  target_compile_options(tpm_options INTERFACE -w)
endif()
# g++ 12 reports overlapping copies inside std::string::replace that cannot happen (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(tpm_options INTERFACE -Wno-restrict)
endif()
# Bit-identity is promised per binary: no contraction that another compiler flag could move.
target_compile_options(tpm_options INTERFACE -ffp-contract=off)
if(TPM_SANITIZE)
  add_compile_options(-fsanitize=${TPM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TPM_SANITIZE})
  # Of UndefinedBehaviorSanitizer, what AddressSanitizer sees as well (null pointers, objects too
  # small or dead) is left out beside it: it doubles the time that the compiler takes.
  if(TPM_SANITIZE MATCHES "address" AND TPM_SANITIZE MATCHES "undefined" AND NOT TPM_SANITIZE_EVERYTHING)
    add_compile_options(-fno-sanitize=null,alignment,object-size,vptr)
  endif()
  if(TPM_SANITIZE_EVERYTHING)
    add_compile_definitions(TPM_SANITIZE_EVERYTHING)
  endif()
  # Under AddressSanitizer Eigen would align by hand, while the packaged Ceres, built without it,
  # leaves that to malloc: matrices handed from one to the other would be freed wrongly.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
  # With the instrumentation in the way g++ takes initialised members of std::regex for uninitialised.
  target_compile_options(tpm_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()

# Headers that most files include are read once. With ccache: CCACHE_SLOPPINESS=pch_defines,time_macros.
option(TPM_COMMON_HEADERS "Read common headers once, as precompiled headers" OFF)
function(tpm_common_headers target)
  if(TPM_COMMON_HEADERS)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()

# mold, lld or gold instead of ld, whichever is there: a link of a test takes half the time.
option(TPM_FAST_LINKER "Link with the fastest linker that is installed" OFF)
if(TPM_FAST_LINKER)
  foreach(linker mold lld gold)
    find_program(TPM_LINKER_${linker} NAMES ${linker} ld.${linker})
    mark_as_advanced(TPM_LINKER_${linker})
    if(TPM_LINKER_${linker})
      add_link_options(-fuse-ld=${linker})
      message(STATUS "Linker: ${linker}")
      break()
    endif()
  endforeach()
endif()

# Files of one target are compiled together, some at a time: most of the compiler's time goes into headers
# that they share. So names in unnamed namespaces are unique within a room of src and a folder of tests.
option(TPM_TOGETHER "Compile the files of one room together (unity build)" OFF)
function(tpm_compile_together target at_a_time)
  if(TPM_TOGETHER)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE BATCH UNITY_BUILD_BATCH_SIZE ${at_a_time})
  endif()
endfunction()

option(TPM_QUICK_TO_BUILD "Do not optimise what only reads, arranges and writes, nor the tests' own code" OFF)
set(TPM_ARRANGING_FLAGS $<$<CONFIG:Release>:-O1>)
if(TPM_QUICK_TO_BUILD)
  set(TPM_ARRANGING_FLAGS -O0)
endif()

# A program or module that is installed: CMake would end its paths of libraries with an empty one until then, and the
# folder in which it is called would be searched for each of them.
function(tpm_load_from_fixed_places target)
  if(NOT BUILD_SHARED_LIBS)  # shared rooms are for working on them: they are not installed
    # Debian's libraries lie where the loader looks; its packages may name no place of their own.
    if(TPM_PACKAGES)
      set(by_path OFF)
    else()
      set(by_path ON)
    endif()
    set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH ON INSTALL_RPATH_USE_LINK_PATH ${by_path})
  endif()
endfunction()
