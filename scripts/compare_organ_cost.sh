#!/usr/bin/env bash
# Builds two commits and prints the processor time of organs of either, the programs in turns:
# filling, joining, ten evaluations of all bonds and, for small ones, a run; each the least of five.
#   scripts/compare_organ_cost.sh A B [ROUNDS]
# Run it on an idle machine. Prints one row of tests/measure/organ_cost.cpp for each program and round.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/build_commit.sh
if [[ $# -lt 2 || $# -gt 3 ]]; then
  echo "usage: scripts/compare_organ_cost.sh A B [ROUNDS]; expected two commits" >&2
  exit 2
fi
rounds=${3:-1}
folder=${TPM_COMPARE_FOLDER:-build/compare_organ_cost}

# This tree's measurement is built against the library of either commit.
with_measurement() { cp tests/measure/{organ_cost.cpp,program.hpp} "$1/tests/measure/"; }

a=$(build_commit "$1" "$folder" measure_organ_cost tests/measure_organ_cost with_measurement)
b=$(build_commit "$2" "$folder" measure_organ_cost tests/measure_organ_cost with_measurement)
for kind in shell cubic bcc fcc; do
  for count in 1000 10000 100000; do
    run=()
    [[ $count == 1000 || ($kind == shell && $count == 10000) ]] && run=(run)
    for ((round = 0; round < rounds; ++round)); do
      echo "A $("$a" $kind $count "${run[@]}" | tail -1)"
      echo "B $("$b" $kind $count "${run[@]}" | tail -1)"
    done
  done
done
