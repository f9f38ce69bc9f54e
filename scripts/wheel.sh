#!/usr/bin/env bash
# Builds one wheel with the Python package tpmkit and the program tpm, without network: dist/tpmkit-*.whl.
# It uses the libraries of this Debian, as the program does, so it is for this release of Debian and its
# Python. Debian packages besides those of run.sh: pybind11-dev, python3-dev, python3-setuptools,
# python3-wheel, python3-pip, python3-pandas, python3-xarray. Then, in an environment that sees Debian's
# modules:
#     python3 -m venv --system-site-packages ENV
#     ENV/bin/pip install --no-index --no-deps dist/tpmkit-*.whl
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to build the wheel" "${packages_run[@]}" "${packages_python[@]}"
python=${TPMKIT_WHEEL_PYTHON:-/usr/bin/python3}

[ -f build/release/CMakeCache.txt ] || configure release -DTPM_BUILD_TESTS=OFF
configure release -DTPM_PYTHON=ON
step "building tpm and the Python module (build/release)"
build release tpm tpmkit_python

step "packing"
stage=build/wheel
rm -rf "$stage"
mkdir -p "$stage"
cmake --install build/release --component program --prefix "$PWD/$stage/root" --strip >/dev/null
mkdir -p "$stage/tpmkit"
cp -r "$stage/root/bin" "$stage/root/share" "$stage/tpmkit/"
rm -rf "$stage/tpmkit/share/man" "$stage/tpmkit/share/bash-completion" "$stage/tpmkit/share/zsh" "$stage/tpmkit/share/fish" "$stage/root"  # share/doc has the notices
cp build/release/python/tpmkit/*.py build/release/python/tpmkit/*.pyi build/release/python/tpmkit/py.typed \
   build/release/python/tpmkit/_core*.so "$stage/tpmkit/"
strip --strip-unneeded "$stage"/tpmkit/_core*.so
cp bindings/python/pyproject.toml bindings/python/setup.py LICENSE "$stage/"
"$stage/tpmkit/bin/tpm" version | cut -d' ' -f2 >"$stage/VERSION"
mkdir -p dist
log=build/wheel.log
(cd "$stage" && "$python" -m pip wheel --no-index --no-deps --no-build-isolation --no-cache-dir -w ../../dist .) \
  >"$log" 2>&1 || { tail -n 15 "$log" >&2; die "pip could not make the wheel (its last lines stand above)"; }
step "done. The wheel:"
ls -1 "$PWD"/dist/tpmkit-*.whl
