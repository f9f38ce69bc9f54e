# Compile options of our own code only; dependencies come in as system headers.
add_library(tpm_options INTERFACE)
target_compile_options(tpm_options INTERFACE -Wall -Wextra -Wconversion -Wshadow
  $<$<BOOL:${TPM_WARNINGS_AS_ERRORS}>:-Werror>)
# g++ 12 reports overlapping copies inside std::string::replace that cannot happen (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(tpm_options INTERFACE -Wno-restrict)
endif()
# Bit-identity is promised per binary: no contraction that another compiler flag could move.
target_compile_options(tpm_options INTERFACE -ffp-contract=off)
if(TPM_SANITIZE)
  add_compile_options(-fsanitize=${TPM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TPM_SANITIZE})
  # Under AddressSanitizer Eigen would align by hand, while the packaged Ceres, built without it,
  # leaves that to malloc: matrices handed from one to the other would be freed wrongly.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
  # With the instrumentation in the way g++ takes initialised members of std::regex for uninitialised.
  target_compile_options(tpm_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()
