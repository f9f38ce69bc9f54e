#!/usr/bin/env bash
# Builds two commits and compares their speed by processor time, in alternation: whole commands that both
# know, and the named pieces of work of `tpm accuracy benchmark --append-to` where both have it.
#   scripts/compare_speed.sh A B [ROUNDS]
# Exit 1 if B needs more than 10 % longer than A for one of them; it is named.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
if [[ $# -lt 2 || $# -gt 3 ]]; then
  echo "usage: scripts/compare_speed.sh A B [ROUNDS]; expected two commits" >&2
  exit 2
fi
rounds=${3:-5}
folder=${TPM_COMPARE_FOLDER:-build/compare_speed}
mkdir -p "$folder"

# program COMMIT: builds it in a work tree of its own, which is kept; prints the program's path.
program() {
  local commit tree
  commit=$(git rev-parse --short=12 --verify "$1^{commit}")
  tree=$(realpath -m "$folder/$commit")
  if [[ ! -x $tree/build/release/tpm ]]; then
    [[ -d $tree ]] || git worktree add --detach "$tree" "$commit" >&2
    mkdir -p "$tree/build"
    [[ -e build/packages && ! -e $tree/build/packages ]] && cp -r build/packages "$tree/build/packages"
    (cd "$tree" && cmake --preset release -DTPM_BUILD_TESTS=OFF && cmake --build build/release --target tpm) \
      > "$tree.log" 2>&1 || { echo "$commit does not build: $tree.log" >&2; exit 5; }
  fi
  echo "$tree/build/release/tpm"
}

a=$(program "$1")
b=$(program "$2")
find_python json
exec "$TPMKIT_PYTHON" scripts/compare_speed.py "$a" "$b" --names "$1" "$2" --rounds "$rounds"
