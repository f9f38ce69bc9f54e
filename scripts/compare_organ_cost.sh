#!/usr/bin/env bash
# Builds two commits and prints the processor time of organs of either, the programs in turns:
# filling, joining, ten evaluations of all bonds and, for small ones, a run; each the least of five.
#   scripts/compare_organ_cost.sh A B [ROUNDS]
# Run it on an idle machine. Prints one row of tests/measure/organ_cost.cpp for each program and round.
set -euo pipefail
cd "$(dirname "$0")/.."
if [[ $# -lt 2 || $# -gt 3 ]]; then
  echo "usage: scripts/compare_organ_cost.sh A B [ROUNDS]; expected two commits" >&2
  exit 2
fi
rounds=${3:-1}
folder=${TPM_COMPARE_FOLDER:-build/compare_organ_cost}
mkdir -p "$folder"

# program COMMIT: builds this tree's measurement against the library of a commit; prints the program's path.
program() {
  local commit tree
  commit=$(git rev-parse --short=12 --verify "$1^{commit}")
  tree=$(realpath -m "$folder/$commit")
  if [[ ! -x $tree/build/release/tests/measure_organ_cost ]]; then
    [[ -d $tree ]] || git worktree add --detach "$tree" "$commit" >&2
    cp tests/measure/{organ_cost.cpp,program.hpp} "$tree/tests/measure/"
    mkdir -p "$tree/build"
    [[ -e build/packages && ! -e $tree/build/packages ]] && cp -r build/packages "$tree/build/packages"
    (cd "$tree" && cmake --preset release && cmake --build build/release --target measure_organ_cost) \
      > "$tree.log" 2>&1 || { echo "$commit does not build: $tree.log" >&2; exit 5; }
  fi
  echo "$tree/build/release/tests/measure_organ_cost"
}

a=$(program "$1")
b=$(program "$2")
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
