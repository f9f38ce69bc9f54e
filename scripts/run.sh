#!/usr/bin/env bash
# Builds tpm, fits the example (a synthetic recording) and makes the report on the paper: its tables, figures, claims and
# fits, recomputed. Results are in out; nothing outside this folder is written except packages.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to build and run tpm" "${packages_run[@]}"
find_python numpy matplotlib

configure release -DTPM_BUILD_TESTS=OFF
step "building tpm (build/release); some minutes the first time"
build release tpm

step "recomputing the paper"
build/release/tpm paper report --folder out/paper
step "done. A synthetic recording and the law that it supports:"
build/release/tpm example recording --folder out/example
build/release/tpm fit out/example/recording.csv --folder out/example/recording_fit
step "the report on the paper; open it in a browser:"
echo "$PWD/out/paper/report.html"
