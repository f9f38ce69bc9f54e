#!/usr/bin/env bash
# Builds `tpm` without parts under the GPL (docs/licences.md) into build/permissive: fetches Debian's source of Ceres
# from this machine's package source, builds it without SuiteSparse, CXSparse and LAPACK, links the program with it,
# and fails if the program still loads a library of SuiteSparse other than KLU and what KLU needs. Needs the packages
# of scripts/run.sh; installs nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to build and run tpm" "${packages_run[@]}"
folder=$PWD/build/packages/ceres-permissive

if [ ! -d "$folder/installed" ]; then
  step "fetching the source of Ceres"
  mirror=$(apt-get indextargets --format '$(REPO_URI)' "Codename: bookworm" 2>/dev/null | head -n 1)
  [ -n "$mirror" ] || die "this machine has no package source of Debian 12"
  rm -rf "$folder"
  mkdir -p "$folder/lists/partial"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" >"$folder/sources.list"
  apt=(apt-get -qq -o "Dir::Etc::sourcelist=$folder/sources.list" -o Dir::Etc::sourceparts=/dev/null
       -o "Dir::State::lists=$folder/lists" -o APT::Sandbox::User=)
  { "${apt[@]}" update && (cd "$folder" && "${apt[@]}" source --download-only ceres-solver); } >"$folder/log" 2>&1 ||
    { tail -n 5 "$folder/log" >&2; die "apt-get could not fetch the source of ceres-solver"; }
  mkdir "$folder/source"
  tar xf "$folder"/ceres-solver_*.orig.tar.* -C "$folder/source" --strip-components 1
  rm -rf "$folder/lists"

  step "building Ceres without SuiteSparse, CXSparse and LAPACK"
  launcher=()
  if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  cmake -S "$folder/source" -B "$folder/build" -G Ninja "${launcher[@]}" -DCMAKE_BUILD_TYPE=Release \
    -DSUITESPARSE=OFF -DCXSPARSE=OFF -DLAPACK=OFF -DEIGENSPARSE=OFF -DSCHUR_SPECIALIZATIONS=OFF -DCUDA=OFF \
    -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF -DBUILD_BENCHMARKS=OFF -DEXPORT_BUILD_DIR=OFF \
    -DPROVIDE_UNINSTALL_TARGET=OFF "-DCMAKE_INSTALL_PREFIX=$folder/part" >"$folder/log" 2>&1 ||
    { tail -n 20 "$folder/log" >&2; die "cmake could not configure Ceres"; }
  ninja -C "$folder/build" -j "$(nproc)" install >"$folder/log" 2>&1 ||
    { tail -n 20 "$folder/log" >&2; die "Ceres could not be built"; }
  rm -rf "$folder/build"
  mv "$folder/part" "$folder/installed"
fi

step "building tpm (build/permissive)"
configure release -B build/permissive "-DCeres_DIR=$folder/installed/lib/cmake/Ceres" -DTPM_BUILD_TESTS=OFF
build permissive tpm

loaded=$(ldd build/permissive/tpm)
if grep -E 'cholmod|cxsparse|spqr|umfpack' <<<"$loaded"; then
  die "the program still loads what is under the GPL (above)"
fi
step "done: $PWD/build/permissive/tpm loads $(grep -c '=>' <<<"$loaded") libraries, none under the GPL but GCC's own, which have its exception"
