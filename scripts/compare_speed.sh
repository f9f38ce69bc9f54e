#!/usr/bin/env bash
# Builds two commits and compares their speed by processor time, in alternation: whole commands that both
# know, and the named pieces of work of `tpm accuracy benchmark --append-to` where both have it.
#   scripts/compare_speed.sh A B [ROUNDS]
# Exit 1 if B needs more than 10 % longer than A for one of them; it is named.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/build_commit.sh
if [[ $# -lt 2 || $# -gt 3 ]]; then
  echo "usage: scripts/compare_speed.sh A B [ROUNDS]; expected two commits" >&2
  exit 2
fi
rounds=${3:-5}
folder=${TPM_COMPARE_FOLDER:-build/compare_speed}

a=$(build_commit "$1" "$folder" tpm tpm : -DTPM_BUILD_TESTS=OFF)
b=$(build_commit "$2" "$folder" tpm tpm : -DTPM_BUILD_TESTS=OFF)
find_python json
exec "$TPMKIT_PYTHON" scripts/compare_speed.py "$a" "$b" --names "$1" "$2" --rounds "$rounds"
