#!/usr/bin/env bash
# Makes the Debian packages of this release into dist/: tpmkit (program), libtpmkit-haptics1 (library for
# haptic loops), libtpmkit-dev (development), python3-tpmkit (Python); has lintian look at them, and fails
# on its errors and warnings. Builds in build/release.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to make Debian packages" "${packages_run[@]}" "${packages_python[@]}" "${packages_debian[@]}"

step "building (build/release); some minutes the first time"
folder=build/release
configure release -DTPM_BUILD_TESTS=OFF -DTPM_PACKAGES=ON -DTPM_PYTHON=ON \
  -DTPM_PYTHON_INSTALL:STRING=lib/python3/dist-packages \
  "-DCMAKE_INSTALL_LIBDIR=lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)"
build release tpm installed_rooms tpmkit_haptics tpmkit_python command_help

step "packing"
# The date of the bill of materials is that of the changelog: equal sources give equal packages.
SOURCE_DATE_EPOCH=$(date -u -d "$(sed -n 's/^ -- .*>  //p' packaging/debian/changelog | head -n 1)" +%s)
export SOURCE_DATE_EPOCH
rm -f "$folder"/*.deb
(cd "$folder" && cpack -G DEB >cpack.log 2>&1) || { tail -n 20 "$folder/cpack.log" >&2; die "cpack failed"; }
mkdir -p dist
mv "$folder"/*.deb dist/

step "lintian"
lintian --fail-on error,warning --tag-display-limit 0 --allow-root dist/*.deb | sed 's/^/   /'
step "done. The packages:"
ls -1 "$PWD"/dist/*.deb
