#!/usr/bin/env bash
# Sanitizers over all of the code: every test but the slow ones under AddressSanitizer and
# UndefinedBehaviorSanitizer (preset asan-ubsan), all that has threads under ThreadSanitizer (preset tsan), all
# failing system calls and kills (docs/architecture.md), clang-tidy on every source. Takes hours; not part of CI.
# Stops at the first failure.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/tidy.sh

install_missing "to build, run and test tpm" "${packages_run[@]}" "${packages_test[@]}"
install_missing "to check its sources and to show its results to other programs" "${packages_check[@]}"
find_python numpy matplotlib scipy h5py

for preset in asan-ubsan tsan; do
  step "building and testing with the preset $preset (build/$preset)"
  configure "$preset" -DTPM_SANITIZE_EVERYTHING=ON
  build "$preset"
  run_tests "$preset"
done

step "failing system calls and kills (build/release)"
configure release -DTPM_BUILD_TESTS=ON
cmake --build build/release --target tpm fault_at
python3 scripts/kill_table.py build/release/tpm build/release/tests/libfault_at.so -o build/kills.md
python3 scripts/fault_table.py build/release/tpm build/release/tests/libfault_at.so -o build/faults.md ||
  echo "build/faults.md lists what docs/architecture.md says of libraries, or more: compare"

step "clang-tidy on all sources"
configure tidy
TPM_TIDY_BASE=all tidy_changed build/tidy

step "all checks passed"
