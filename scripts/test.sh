#!/usr/bin/env bash
# Builds and runs the tests, from a bare machine on, in the build folder of run.sh. Ends with the closing
# lines of ctest. The slow tests, formatting, clang-tidy and sanitizers are in scripts/check.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to build, run and test tpm" "${packages_run[@]}" "${packages_test[@]}"
find_python numpy matplotlib scipy h5py

# shellcheck disable=SC2086  # several options in one word
configure release -DTPM_BUILD_TESTS=ON -DTPM_SLOW_TESTS=OFF -DTPM_SANITIZED_COPIES=OFF ${TPM_CMAKE_OPTIONS-}
step "building tpm and its tests (build/release)"
build release

step "tests"
run_tests tests
step "done"
