#!/usr/bin/env bash
# Makes docs/figures/view.png, a simulation in `tpm view`, and docs/figures/first_look.png, the picture of
# docs/haptics.md: the live page of a session on the simulated device, photographed by Chromium, beside error against
# cost from reports/accuracy/servo_normal.csv.
# Takes about a minute. Needs build/release/tpm (scripts/run.sh) and chromium.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/packages.sh
install_missing "to photograph a page" chromium
find_python numpy matplotlib
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
build/release/tpm simulate configs/liver_poke.json -o "$folder/poke.h5"
build/release/tpm view "$folder/poke.h5" -o "$folder/poke.html"
chromium --headless --no-sandbox --disable-gpu --user-data-dir="$folder/profile" --hide-scrollbars \
  --force-device-scale-factor=2 --window-size=640,860 --virtual-time-budget=3000 \
  --screenshot="$PWD/docs/figures/view.png" "file://$folder/poke.html"
say "docs/figures/view.png"
"$TPMKIT_PYTHON" tests/programs/page_in_chromium.py build/release/tpm configs/hil_surface.json "$folder/page.png" 14
"$TPMKIT_PYTHON" scripts/draw_first_look.py "$folder/page.png" reports/accuracy/servo_normal.csv docs/figures/first_look.png
say "docs/figures/first_look.png"
