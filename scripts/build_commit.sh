# shellcheck shell=bash
# Sourced by compare_speed.sh and compare_organ_cost.sh from the project's folder: builds programs of commits.

# build_commit COMMIT FOLDER TARGET PROGRAM PREPARE [CMAKE_OPTION...]: builds a target of a commit in a work tree of
# its own below FOLDER, which is kept, after `PREPARE TREE`. Prints the path of PROGRAM, which is below build/release.
build_commit() {
  local commit tree folder=$2 target=$3 program=$4 prepare=$5
  commit=$(git rev-parse --short=12 --verify "$1^{commit}")
  tree=$(realpath -m "$folder/$commit")
  shift 5
  if [[ ! -x $tree/build/release/$program ]]; then
    mkdir -p "$folder"
    [[ -d $tree ]] || git worktree add --detach "$tree" "$commit" >&2
    "$prepare" "$tree"
    mkdir -p "$tree/build"
    [[ -e build/packages && ! -e $tree/build/packages ]] && cp -r build/packages "$tree/build/packages"
    (cd "$tree" && cmake --preset release "$@" && cmake --build build/release --target "$target") \
      > "$tree.log" 2>&1 || { echo "$commit does not build: $tree.log" >&2; exit 5; }
  fi
  echo "$tree/build/release/$program"
}
