#!/usr/bin/env bash
# What a maintainer checks beyond scripts/test.sh: formatting, the slow tests (with Chromium, ParaView, the
# Python package, notebooks and full disks), every source compiled with warnings as errors, the fast tests of the rooms in
# TPM_SANITIZED_ROOMS (cmake/TpmRooms.cmake) under AddressSanitizer and UndefinedBehaviorSanitizer, those
# with threads under ThreadSanitizer, half a minute of fuzzing, clang-tidy on what changed. Stops at the first failure; ends with the
# closing lines of the slow tests. Everything under sanitizers: presets asan-ubsan and tsan.
#
#   TPM_TIDY_BASE=COMMIT  clang-tidy checks the sources changed since COMMIT; `all` checks all.
#                         Default: since the merge base with origin's branch, or the last commit.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/tidy.sh

install_missing "to build, run and test tpm" "${packages_run[@]}" "${packages_test[@]}"
install_missing "to check its sources and to show its results to other programs" "${packages_check[@]}"
install_missing "to build and test the Python package" "${packages_python[@]}"
find_python numpy matplotlib scipy h5py

step "formatting (clang-format)"
git ls-files '*.cpp' '*.hpp' | xargs clang-format --dry-run -Werror

step "one name, one type"  # two types of one name link without a word and break at run time
twice=$(git ls-files 'src/tpm/*.hpp' 'include/tpmkit/*.hpp' | xargs grep -hoE '^(struct|class|enum class) \w+( final)?( :.*)? ?\{' |
        awk '{print $1 == "enum" ? $3 : $2}' | sort | uniq -d)
[[ -z "$twice" ]] || die "src/tpm and include define more than one type named: $twice; expected one of a name"

step "no loop over a part of a temporary"  # for (x : read_json(file).at("rows")): C++20 ends what is read before the first round
ended=$(git ls-files '*.cpp' '*.hpp' | xargs grep -nE 'for \(.* : (\w+_)?json\(.*\)\.(at|items|begin|front|back)\b' || true)
[[ -z "$ended" ]] || die "a loop reads what has ended; give it a name before the loop: $ended"

step "building the slow tests and sanitized copies, warnings as errors (build/release)"
configure release -DTPM_BUILD_TESTS=ON -DTPM_SLOW_TESTS=ON -DTPM_PYTHON=ON -DTPM_SANITIZED_COPIES=ON \
  -DTPM_WARNINGS=ON -DTPM_WARNINGS_AS_ERRORS=ON
build release
step "slow tests"
slow_log=build/ctest-slow.log
run_tests slow | tee "$slow_log"

step "the wheel, installed without network"
scripts/wheel.sh >build/wheel.out || die "no wheel; its words: $(tail -n 3 build/wheel.out)"
rm -rf build/wheel_environment
/usr/bin/python3 -m venv --system-site-packages build/wheel_environment
build/wheel_environment/bin/pip install -q --no-index --no-deps dist/tpmkit-*.whl
(cd / && "$OLDPWD/build/wheel_environment/bin/python" -c 'import tpmkit; tpmkit.example("configs/liver_poke.json")')
(cd / && "$OLDPWD/build/wheel_environment/bin/tpm" version)

step "clang-tidy on $(tidy_scope)"
configure tidy
tidy_changed build/tidy

step "fast tests of sanitized rooms, tests with threads under ThreadSanitizer"
sanitized_log=build/ctest-sanitized.log
run_tests sanitized >"$sanitized_log" || die "$(tail -n 80 "$sanitized_log")"
tail -n 4 "$sanitized_log"

# 23 kinds of input, 3 s of processor time each, on two cores: half a minute. scripts/fuzz.sh 310 is the whole of it.
scripts/fuzz.sh --readers 3

step "all checks passed; the slow tests ended with:"
sed -n '/% tests passed/,$p' "$slow_log"
