#!/usr/bin/env bash
# Packs the committed sources into FOLDER/tpmkit-VERSION.tar.gz (dist, if no folder is given) and prints its name. The
# archive builds without git:
#     tar xf tpmkit-0.1.0.tar.gz && cd tpmkit-0.1.0 && scripts/run.sh
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-$PWD/dist}
version=$(sed -n 's/^project(tpmkit VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
mkdir -p "$folder"
# gzip -n: equal commits give equal bytes.
git archive --format=tar --prefix="tpmkit-$version/" HEAD | gzip -9n >"$folder/tpmkit-$version.tar.gz"
echo "$folder/tpmkit-$version.tar.gz"
