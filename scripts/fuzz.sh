#!/usr/bin/env bash
# Fuzzes every kind of input for SECONDS of processor time each, on all processors (libFuzzer, with AddressSanitizer and
# UndefinedBehaviorSanitizer; needs clang), in four quarters, and prints a table: executions, executions per second of
# processor time, percent of the edges of the reader's own file covered after each quarter, the quarters with a
# finding. A finding is kept in tests/fuzz/corpus, which the ordinary tests run; exit code 1 if there is one.
#
#   scripts/fuzz.sh 60             a minute each
#   scripts/fuzz.sh 300 scene stl  five minutes for two of them
#   scripts/fuzz.sh --readers 3    only what reads is instrumented, the rest is that of build/release, which has to be
#                                  there; scripts/check.sh runs it. Below a minute each it is one run without coverage
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

preset=fuzz quarters="1 2 3 4" coverage=1
if [[ "${1:-}" == --readers ]]; then
  preset=fuzz-readers
  shift
  [[ -f build/release/libtpmkit_base.a ]] || die "no build/release/libtpmkit_base.a; expected scripts/run.sh before"
fi
[[ "${1:-}" =~ ^[1-9][0-9]*$ ]] || die "usage: scripts/fuzz.sh [--readers] SECONDS [INPUT...]"
seconds=$1
shift
if [[ $preset == fuzz-readers && $seconds -lt 60 ]]; then
  quarters=4 coverage=0  # naming what a run covered takes 20 s
fi
install_missing "to build and run tpm" "${packages_run[@]}"
install_missing "to fuzz what tpm reads" clang

step "building the fuzzer (build/$preset)"
configure "$preset"
build "$preset" fuzz_inputs

shopt -s nullglob
names=("$@")
[[ ${#names[@]} -gt 0 ]] || mapfile -t names < <(sed -n 's/^    {"\([a-z0-9_]*\)", "\..*/\1/p' tests/fuzz/inputs.cpp)
folder=$(mktemp -d -p /dev/shm tpm-fuzz-XXXXXX)
trap 'rm -rf "$folder"' EXIT

seeds_of() {
  case $1 in
    delimited_text) echo data/*.csv tests/fixtures/*.csv ;;
    curve_description) echo data/evren*.json data/amy*.json ;;
    digitizer_project) echo tests/fixtures/*.json ;;
    fit) echo configs/liver_{all,fig3,indentation,relaxation}.json ;;
    session) echo configs/hil_{law,liver,network,omega7,planned}.json ;;  # hil_surface follows a surface for seconds
    sweep) echo configs/sweep_x_depth.json configs/sweep_creep_work.json ;;
    design) echo configs/design_*.json ;;
    claims) echo data/paper_claims.json ;;
    organ_study) echo configs/organ_*.json ;;
    fit_tables) echo configs/liver_tables/problem.json ;;
    row_log) echo tests/fuzz/corpus/{recording/cut.tpmrec,sweep_log/begun.blocks} ;;
  esac
}

# The file in src/tpm whose coverage is shown.
reader_of() {
  case $1 in
    delimited_text) echo files/delimited.cpp ;;
    curve_description) echo files/import/description.cpp ;;
    digitizer_project) echo files/import/import_wpd_json.cpp ;;
    jpk) echo files/import/import_jpk.cpp ;;
    scene) echo organ/scene/scene.cpp ;;
    fit) echo fit/likelihood/config.cpp ;;
    fit_tables) echo fit/petab.cpp ;;
    session) echo haptics/session/session.cpp ;;
    sweep) echo sweep/sweep_file.cpp ;;
    design) echo fit/design/design_file.cpp ;;
    organ_study) echo paper/organ_study_file.cpp ;;
    costs) echo plan/operations.cpp ;;
    law) echo files/blocks/law_file.cpp ;;
    claims) echo paper/claims/claim_reader.cpp ;;
    stl | obj) echo organ/body/mesh_file.cpp ;;
    recording) echo haptics/session/recording.cpp ;;
    row_log) echo files/row_log.cpp ;;
    sweep_log) echo sweep/block_log.cpp ;;
    checkpoint) echo organ/run/checkpoint.cpp ;;
    hdf5) echo files/hdf5/hdf5_contents.cpp ;;
    web_socket) echo haptics/inverse/web_socket.cpp ;;
    inverse) echo haptics/inverse/messages.cpp ;;
  esac
}

# Edges covered of a file, in percent, from the log of a run.
covered() { # FILE LOG
  awk -v file="/src/tpm/$1:" '
    /COVERED_FUNC/ && index($0, file) { split($5, edges, "/"); hit += edges[1]; all += edges[2] }
    END { printf "%.0f", (all > 0 ? 100 * hit / all : 0) }' "$2"
}

# A liver takes seconds to be filled under the sanitizers, a block of spheres none.
blocks_for_livers='
import json, sys
def put(node):
    if isinstance(node, dict):
        if isinstance(node.get("organ"), dict) and node["organ"].get("kind") == "liver":
            node["organ"] = {"kind": "block", "cells": [3, 3, 3]}
        node = node.values()
    if not isinstance(node, str):
        for member in node if hasattr(node, "__iter__") else []: put(member)
for name in sys.argv[1:]:
    document = json.load(open(name))
    put(document)
    json.dump(document, open(name, "w"))
'

fuzz() { # NAME
  local name=$1 found=none status=0 runs=0 percent=""
  local seeds="$folder/$name/seeds" place="$folder/$name/configs" kept=tests/fuzz/corpus/$name
  mkdir -p "$seeds" "$kept"
  for file in $(seeds_of "$name") "$kept"/*; do cp "$file" "$seeds/"; done
  cp -r configs "$place"  # what inputs name stands where they expect it
  cp -r data "$folder/$name/data"
  if [[ $name == fit_tables ]]; then cp configs/liver_tables/* "$place/"; fi
  find "$seeds" "$place" -name '*.json' -exec python3 -c "$blocks_for_livers" {} +
  # a description has the name of its file
  if [[ $name == curve_description ]]; then sed -i 's/"id": "[a-z_]*"/"id": "case"/' "$seeds"/*; fi
  local -i begun=$(processor_seconds)
  for quarter in $quarters; do
    local log=build/$preset/$name.$quarter.log
    local -i left=$((begun + quarter * seconds / 4 - $(processor_seconds)))
    while true; do  # again while a busy machine gave less than the time that passed
      TPM_FUZZ=$name TPM_FUZZ_FOLDER=$place ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 \
        build/$preset/fuzz_inputs -max_total_time=$((left > 1 ? left : 1)) -timeout=60 -report_slow_units=60 -rss_limit_mb=4096 -max_len=30000 \
        -artifact_prefix="$kept/found-" -print_final_stats=1 "$seeds" >"$log" 2>&1 ||
        { status=1; found="${found#none} $quarter"; }
      runs=$((runs + $(sed -n 's/^stat::number_of_executed_units: *//p' "$log")))
      left=$((begun + quarter * seconds / 4 - $(processor_seconds)))
      [[ $left -gt 0 && $status -eq 0 ]] || break
    done
    if [[ $coverage == 1 ]]; then  # by what has been kept so far; its time does not count
      local -i before=$(processor_seconds)
      TPM_FUZZ=$name TPM_FUZZ_FOLDER=$place ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 \
        build/$preset/fuzz_inputs -runs=0 -timeout=60 -rss_limit_mb=4096 -max_len=30000 -print_coverage=1 \
        "$seeds" >"$log.covered" 2>&1 || { status=1; found="${found#none} $quarter"; }
      percent+="| $(covered "$(reader_of "$name")" "$log.covered") "
      begun+=$(($(processor_seconds) - before))
    fi
  done
  # A child that HDF5 brought down is contained; libFuzzer's handler in it may open a file, but not write into it.
  find "$kept" -name 'found-*' -empty -delete
  rmdir --ignore-fail-on-non-empty "$kept"
  local -r took=$(($(processor_seconds) - begun))
  echo "| $name | $runs | $took | $((runs / (took > 0 ? took : 1))) | src/tpm/$(reader_of "$name") |" \
    "${percent:2}${percent:+| }$found |"
  return $status
}

# Of all that this shell has started and waited for.
processor_seconds() {
  awk -v ticks="$(getconf CLK_TCK)" '{ printf "%d", ($16 + $17) / ticks }' "/proc/$$/stat"
}

step "fuzzing ${#names[@]} kinds of input, $seconds s each"
export -f fuzz seeds_of reader_of covered processor_seconds
export folder seconds preset quarters coverage blocks_for_livers
found=0
if [[ $coverage == 1 ]]; then
  echo "| input | executions | processor time / s | executions / s | file | edges covered / %: first quarter | second |" \
    "third | last | finding in quarter |"
  echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
else
  echo "| input | executions | processor time / s | executions / s | file | finding in quarter |"
  echo "| --- | --- | --- | --- | --- | --- |"
fi
printf '%s\n' "${names[@]}" | xargs -P "$(nproc)" -I{} bash -c 'shopt -s nullglob; fuzz {}' || found=1
[[ $found -eq 0 ]] || die "findings are in tests/fuzz/corpus; logs in build/$preset"
