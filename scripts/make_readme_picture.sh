#!/usr/bin/env bash
# Makes docs/figures/first_look.png, the picture of docs/haptics.md: the live page of a session on the simulated
# device, photographed by Chromium, beside error against cost from reports/accuracy/servo_normal.csv.
# Takes about a minute. Needs build/release/tpm (scripts/run.sh) and chromium.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/packages.sh
install_missing "to photograph a page" chromium
find_python numpy matplotlib
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$TPMKIT_PYTHON" tests/programs/page_in_chromium.py build/release/tpm configs/hil_surface.json "$folder/page.png" 14
"$TPMKIT_PYTHON" scripts/draw_first_look.py "$folder/page.png" reports/accuracy/servo_normal.csv docs/figures/first_look.png
say "docs/figures/first_look.png"
