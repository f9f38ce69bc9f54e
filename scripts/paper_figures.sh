#!/usr/bin/env bash
# Makes the figures of paper/paper.md in paper/figures:
#   scripts/paper_figures.sh [TPM]     # TPM: build/release/tpm unless given
# relaxation.png and profiles.png are figures of `tpm paper report`, budget.png is that of `tpm budget`. Takes about 20 s
# of processor time. All of it starts from the numbers in data/; nothing is timed, so the same program makes the same
# figures.
set -euo pipefail
program=$(realpath -m "${1:-$(dirname "$0")/../build/release/tpm}")
cd "$(dirname "$0")/.."
source scripts/install_packages.sh
[[ $# -le 1 ]] || die "usage: scripts/paper_figures.sh [TPM]; expected one program at most"
[[ -x $program && ! -d $program ]] || die "$program: is not a program; expected that of scripts/run.sh, or another as argument"
find_python numpy matplotlib
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

step "the published model recomputed"
"$program" paper report --folder "$folder/report" >"$folder/report.txt"
"$TPMKIT_PYTHON" scripts/draw_figures.py "$folder/report/figures.json" "$folder/drawn" --print

step "what is lost between the data and a hand"
"$program" fit configs/liver_relaxation.json --folder "$folder/liver_fit" >"$folder/fit.txt"
"$program" budget "$folder/liver_fit/law.json" --scene configs/budget_liver.json --folder "$folder/budget" >"$folder/budget.txt"

# All were made: only now are the old ones replaced.
mkdir -p paper/figures
install -m 644 "$folder/drawn/figure_07.png" paper/figures/relaxation.png
install -m 644 "$folder/drawn/fit_profiles.png" paper/figures/profiles.png
install -m 644 "$folder/budget/budget.png" paper/figures/budget.png
step "paper/figures: relaxation.png, profiles.png, budget.png"
