#!/usr/bin/env bash
# Fuzzes every kind of input for SECONDS of wall time each, on all processors (libFuzzer, with AddressSanitizer and
# UndefinedBehaviorSanitizer; needs clang), and prints for each: executions, executions a second, edges covered after
# a quarter, a half and all of the time, findings. A finding is kept in tests/fuzz/corpus, which the ordinary tests
# run; exit code 1 if there is one.
#
#   scripts/fuzz.sh 60             a minute each
#   scripts/fuzz.sh 300 scene stl  five minutes for two of them
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

[[ "${1:-}" =~ ^[1-9][0-9]*$ ]] || die "usage: scripts/fuzz.sh SECONDS [INPUT...]"
seconds=$1
shift
install_missing "to build and run tpm" "${packages_run[@]}"
unpack_headers "${packages_unpacked[@]}"
install_missing "to fuzz what tpm reads" clang

step "building the fuzzer (build/fuzz)"
configure fuzz
build fuzz fuzz_inputs

shopt -s nullglob
names=("$@")
[[ ${#names[@]} -gt 0 ]] || mapfile -t names < <(sed -n 's/^    {"\([a-z_]*\)", "\..*/\1/p' tests/fuzz/inputs.cpp)
folder=$(mktemp -d -p /dev/shm tpm-fuzz-XXXXXX)
trap 'rm -rf "$folder"' EXIT

seeds_of() {
  case $1 in
    delimited_text) echo data/*.csv tests/fixtures/*.csv ;;
    curve_description) echo data/evren*.json data/amy*.json ;;
    digitizer_project) echo tests/fixtures/*.json ;;
    fit) echo configs/liver_{all,fig3,indentation,relaxation}.json ;;
    session) echo configs/hil_*.json ;;
    sweep) echo configs/sweep_x_depth.json configs/sweep_creep_work.json ;;
    design) echo configs/design_*.json ;;
    claims) echo data/paper_claims.json ;;
    organ_study) echo configs/organ_*.json ;;
    costs) echo configs/plan/*.json ;;
    fit_tables) echo configs/liver_tables/problem.json ;;
    checkpoint) echo tests/fuzz/corpus/hdf5/packed.h5 ;;
    row_log) echo tests/fuzz/corpus/{recording/cut.tpmrec,sweep_log/begun.blocks} ;;
  esac
}

fuzz() { # NAME
  local name=$1 seeds="$folder/$1.seeds" place="$folder/$1.files" kept=tests/fuzz/corpus/$1 log=build/fuzz/$1.log
  local -i status=0
  mkdir -p "$seeds" "$place" "$kept"
  for file in $(seeds_of "$name") "$kept"/*; do cp "$file" "$seeds/"; done
  TPM_FUZZ=$name TPM_FUZZ_FOLDER=$place ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 \
    build/fuzz/fuzz_inputs -max_total_time="$seconds" -timeout=30 -rss_limit_mb=4096 -max_len=20000 \
    -artifact_prefix="$kept/found-" -print_final_stats=1 "$seeds" >"$log" 2>&1 || status=$?
  rmdir --ignore-fail-on-non-empty "$kept"
  awk -v name="$name" -v status=$status '
    $1 ~ /^#[0-9]+$/ { for (i = 1; i < NF; ++i) if ($i == "cov:") { cov[++n] = $(i + 1) } }
    $1 == "stat::number_of_executed_units:" { runs = $2 }
    $1 == "stat::average_exec_per_sec:" { rate = $2 }
    /^SUMMARY|^==.*ERROR/ { said = said " " $0 }
    END { printf "%-18s %9d executions %7d /s  edges %6d %6d %6d  %s\n", name, runs, rate,
          cov[int((n + 3) / 4)], cov[int((n + 1) / 2)], cov[n], status == 0 ? "no finding" : "FOUND:" said }' "$log"
  return $status
}

step "fuzzing ${#names[@]} kinds of input, $seconds s each"
export -f fuzz seeds_of
export folder seconds
found=0
printf '%s\n' "${names[@]}" | xargs -P "$(nproc)" -I{} bash -c 'shopt -s nullglob; fuzz {}' || found=1
[[ $found -eq 0 ]] || die "findings are in tests/fuzz/corpus; logs in build/fuzz"
