#!/usr/bin/env bash
# Packs the committed sources into dist/tpmkit-VERSION.tar.gz. The archive builds without git:
#     tar xf tpmkit-0.1.0.tar.gz && cd tpmkit-0.1.0 && scripts/run.sh
set -euo pipefail
cd "$(dirname "$0")/.."
version=$(sed -n 's/^project(tpmkit VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
mkdir -p dist
# gzip -n: equal commits give equal bytes.
git archive --format=tar --prefix="tpmkit-$version/" HEAD | gzip -9n >"dist/tpmkit-$version.tar.gz"
echo "$PWD/dist/tpmkit-$version.tar.gz"
