#!/usr/bin/env bash
# Makes docs/figures/view.png, a simulation, and docs/figures/first_look.png, a session on the simulated device in
# virtual time: pages of `tpm view`, photographed by Chromium at a width whose text is read at 400 pixels.
# Takes about a minute. Needs build/release/tpm (scripts/run.sh), or TPM=FILE, and chromium.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
source scripts/packages.sh
install_missing "to photograph a page" chromium
tpm=${TPM:-build/release/tpm}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

photograph() {  # RESULT HEIGHT PICTURE
  "$tpm" view "$1" -o "$folder/page.html"
  chromium --headless --no-sandbox --disable-gpu --user-data-dir="$folder/profile" --hide-scrollbars \
    --force-device-scale-factor=2 --window-size="640,$2" --virtual-time-budget=3000 \
    --screenshot="$PWD/$3" "file://$folder/page.html"
  rm "$folder/page.html"
  say "$3"
}

"$tpm" simulate configs/liver_poke.json -o "$folder/poke.h5"
photograph "$folder/poke.h5" 860 docs/figures/view.png
"$tpm" hil run configs/hil_surface.json -o "$folder/slide.tpmrec"
photograph "$folder/slide.tpmrec" 985 docs/figures/first_look.png
