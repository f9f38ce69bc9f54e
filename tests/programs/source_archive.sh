#!/usr/bin/env bash
# The archive of the sources (scripts/source_tarball.sh) can be configured where there is no git, and its program knows
# its version: what would be compiled is listed, and nothing calls git.
#   source_archive.sh SOURCES FOLDER
set -euo pipefail
sources=$1 folder=$2
if ! git -C "$sources" rev-parse --verify --quiet HEAD >/dev/null 2>&1; then
  echo "no git or no repository here: skipped"
  exit 77
fi
rm -rf "$folder"
mkdir -p "$folder/bin"
archive=$(cd "$sources" && scripts/source_tarball.sh "$folder")
tar -xf "$archive" -C "$folder"
tree=$(find "$folder" -mindepth 1 -maxdepth 1 -type d -name 'tpmkit-*')
[[ ! -e "$tree/.git" ]] || { echo "the archive holds a repository"; exit 1; }
missing=$(comm -23 <(git -C "$sources" ls-tree -r --name-only HEAD | sort) <(cd "$tree" && find . -type f -o -type l | sed 's|^\./||' | sort))
[[ -z "$missing" ]] || { echo "not in the archive: $missing"; exit 1; }

printf '#!/bin/sh\necho "$@" >>%q\nexit 1\n' "$folder/git_was_called" >"$folder/bin/git"
chmod +x "$folder/bin/git"
(cd "$tree" && PATH="$folder/bin:$PATH" cmake --preset release -DTPM_BUILD_TESTS=OFF >"$folder/configure.log" 2>&1) ||
  { tail -n 20 "$folder/configure.log"; exit 1; }
commands=$(ninja -C "$tree/build/release" -t commands tpm)
version=$(sed -n 's/^project(tpmkit VERSION \([0-9.]*\).*/\1/p' "$tree/CMakeLists.txt")
grep -qF "TPM_VERSION=\\\"$version\\\"" <<<"$commands" || { echo "no source is given the version $version"; exit 1; }
[[ ! -e "$folder/git_was_called" ]] || { echo "git was called: $(cat "$folder/git_was_called")"; exit 1; }
rm -rf "$folder"
