#!/usr/bin/env bash
# Every check of the project, from a bare machine on: formatting, a build with warnings as errors,
# the tests, clang-tidy on what changed, the fast tests under AddressSanitizer and
# UndefinedBehaviorSanitizer. Stops at the first failure; ends with the closing lines of the tests.
#
#   TPM_THREAD_SANITIZER=1  also the tests with threads under ThreadSanitizer.
#   TPM_TIDY_BASE=COMMIT  clang-tidy checks the sources changed since COMMIT; `all` checks all.
#                         Default: since the merge base with origin's branch, or the last commit.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/tidy.sh

step() { say "[$((SECONDS / 60)) min $((SECONDS % 60)) s] $*"; }

install_missing "to build and run tpm" "${packages_run[@]}"
install_missing "to test it" "${packages_test[@]}"
install_missing "to check its sources" "${packages_lint[@]}"
find_python numpy matplotlib scipy h5py

step "formatting (clang-format)"
git ls-files '*.cpp' '*.hpp' | xargs clang-format --dry-run -Werror

step "building with warnings as errors (build/ci)"
configure ci
build ci

step "tests (build/ci)"
main_log=build/ctest-ci.log
ctest --preset ci --parallel "$(nproc)" --no-tests=error | tee "$main_log"

step "clang-tidy on $(tidy_scope)"
tidy_changed build/ci

step "building with AddressSanitizer and UndefinedBehaviorSanitizer (build/asan-ubsan)"
configure asan-ubsan
build asan-ubsan
step "fast tests under both"
ctest --preset asan-ubsan --parallel "$(nproc)" --no-tests=error | tail -n 4

if [[ "${TPM_THREAD_SANITIZER:-0}" == 1 ]]; then
  step "tests labelled 'threads' under ThreadSanitizer (build/tsan)"
  configure tsan
  build tsan
  ctest --preset tsan --no-tests=error | tail -n 4
else
  step "ThreadSanitizer: left out; TPM_THREAD_SANITIZER=1 runs it on the tests labelled 'threads'"
fi

step "all checks passed; the tests of build/ci ended with:"
sed -n '/% tests passed/,$p' "$main_log"
