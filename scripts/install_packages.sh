# shellcheck shell=bash
# Sourced by run.sh, test.sh and check.sh from the project's folder: installs what is missing, finds a Python
# that has the modules, configures and builds.

say() { printf '== %s\n' "$*"; }
step() { say "[$((SECONDS / 60)) min $((SECONDS % 60)) s] $*"; }

die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# shellcheck source=packages.sh
source scripts/packages.sh

is_installed() {
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

# install_missing REASON PACKAGE...: leaves the network alone if every package is there.
install_missing() {
  local reason=$1 package
  shift
  if ! command -v dpkg-query >/dev/null; then
    say "no dpkg here: expecting the counterparts of these Debian packages: $*"
    return
  fi
  local missing=()
  for package in "$@"; do is_installed "$package" || missing+=("$package"); done
  [ ${#missing[@]} -gt 0 ] || return 0

  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null ||
      die "these packages are missing, and there is neither root nor sudo to install them: ${missing[*]}"
    as_root=(sudo)
  fi
  say "installing ${#missing[@]} packages $reason: ${missing[*]}"
  local log apt
  log=$(mktemp)
  apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 apt-get -q -y)
  if ! { "${apt[@]}" update && "${apt[@]}" install --no-install-recommends "${missing[@]}"; } \
    >"$log" 2>&1 </dev/null; then
    tail -n 15 "$log" >&2
    rm -f "$log"
    die "apt-get could not install them (its last lines stand above)"
  fi
  rm -f "$log"
}

# find_python MODULE...: sets and exports TPMKIT_PYTHON. The first `python3` on the path may be a
# version manager's, which does not see the distribution's modules.
find_python() {
  local candidate imports tried=()
  imports=$(printf 'import %s;' "$@")
  for candidate in ${TPMKIT_PYTHON:+"$TPMKIT_PYTHON"} python3 /usr/bin/python3 /usr/local/bin/python3; do
    tried+=("$candidate")
    (cd / && "$candidate" -c "$imports") >/dev/null 2>&1 || continue  # imports nothing from here
    TPMKIT_PYTHON=$(command -v "$candidate")
    export TPMKIT_PYTHON
    say "Python with $*: $TPMKIT_PYTHON"
    return
  done
  die "no Python with the modules $*; tried ${tried[*]}"
}

# configure PRESET [CMAKE_ARGUMENT...]: quiet unless it fails; uses ccache where there is one.
configure() {
  local preset=$1 log=build/configure-$1.log
  shift
  local launcher=()
  if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  mkdir -p build
  cmake --preset "$preset" "${launcher[@]}" "$@" >"$log" 2>&1 && return
  cat "$log" >&2
  die "cmake could not configure the preset '$preset' (its words stand above)"
}

# build PRESET [TARGET...]: shows its progress on a terminal, quiet in a pipe
build() {
  local folder=build/$1 quiet=()
  shift
  [ -t 1 ] || quiet=(--quiet)
  NINJA_STATUS='   [%f of %t, %e s] ' ninja -C "$folder" -j "$(nproc)" "${quiet[@]}" "$@"
}

# run_tests PRESET: ctest, one test more at once than there are processors: some wait for the clock (tests/CMakeLists.txt).
# Where tests fail, the end of what each of them said follows ctest's list
run_tests() {
  local found=$PWD/build/tests-$1.xml
  ctest --preset "$1" --parallel "$(($(nproc) + 1))" --no-tests=error --output-junit "$found" && return
  local failed=$?
  python3 - "$found" <<'END'
import sys, xml.etree.ElementTree as xml
for test in xml.parse(sys.argv[1]).iter("testcase"):
    if test.find("failure") is not None:
        print(f"\n{test.get('name')}:", *test.findtext("system-out", "").splitlines()[-40:], sep="\n  ")
END
  return "$failed"
}
