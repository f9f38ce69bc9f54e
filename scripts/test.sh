#!/usr/bin/env bash
# Every check of the project, from a bare machine on: formatting, a build with warnings as errors,
# the tests, clang-tidy on what changed, the fast tests once more with the floors of
# TPM_SANITIZED_FLOORS (cmake/TpmFloors.cmake) under AddressSanitizer and UndefinedBehaviorSanitizer,
# those with threads under ThreadSanitizer. Stops at the first failure; ends with the closing lines of
# the tests. All floors, the program and the tests' own code under sanitizers: presets asan-ubsan, tsan.
#
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

step "one name, one type"  # two types of one name link without a word and break at run time
twice=$(git ls-files 'src/tpm/*.hpp' | xargs grep -hoE '^(struct|class|enum class) \w+( final)?( :.*)? ?\{' |
        awk '{print $1 == "enum" ? $3 : $2}' | sort | uniq -d)
[[ -z "$twice" ]] || die "src/tpm defines more than one type named: $twice; expected one of a name"

step "building with warnings as errors (build/ci)"
configure ci
build ci

step "tests (build/ci)"
main_log=build/ctest-ci.log
ctest --preset ci --parallel "$(nproc)" --no-tests=error | tee "$main_log"

step "clang-tidy on $(tidy_scope)"
configure tidy
tidy_changed build/tidy

step "fast tests with sanitized floors, tests with threads under ThreadSanitizer"
ctest --preset sanitized --parallel "$(nproc)" --no-tests=error | tail -n 4

step "all checks passed; the tests of build/ci ended with:"
sed -n '/% tests passed/,$p' "$main_log"
