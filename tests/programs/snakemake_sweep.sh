#!/bin/sh
# snakemake_sweep.sh TPM: scripts/sweep.smk runs the shards of a sweep and merges them to the bytes of the sweep in
# one piece. Exit 77 where there is no Snakemake (Debian: snakemake).
set -eu
tpm=$1
command -v snakemake > /dev/null || exit 77
source=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
# 16 cells in 4 blocks, so that each shard has some.
sed '0,/{/s//{"block": 4,/' "$source/configs/sweep_x_depth.json" > s.json
"$tpm" sweep s.json -o whole.h5 > /dev/null
snakemake -q -s "$source/scripts/sweep.smk" --cores 1 --config sweep=s.json output=parts.h5 shards=3 tpm="$tpm"
cmp whole.h5 parts.h5
cmp whole.csv parts.csv
