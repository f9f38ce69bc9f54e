# shellcheck shell=bash
# Sourced by check.sh: clang-tidy on the sources that changed since a base commit.

# The commit to compare with: $TPM_TIDY_BASE, else the merge base with origin's branch, else the
# commit before. Prints nothing if there is none, or for `all`.
tidy_base() {
  [ "${TPM_TIDY_BASE:-}" != all ] || return 0
  if [ -n "${TPM_TIDY_BASE:-}" ]; then
    git rev-parse --verify --quiet "$TPM_TIDY_BASE^{commit}" ||
      die "TPM_TIDY_BASE=$TPM_TIDY_BASE: no such commit; expected a commit or 'all'"
    return
  fi
  local base head
  head=$(git rev-parse HEAD)
  base=$(git merge-base HEAD origin/HEAD 2>/dev/null || true)
  if [ -z "$base" ] || [ "$base" = "$head" ]; then
    base=$(git rev-parse --verify --quiet HEAD~1 || true)
  fi
  echo "$base"
}

tidy_scope() {
  local base
  base=$(tidy_base)
  if [ -n "$base" ]; then echo "what changed since $(git rev-parse --short "$base")"; else echo "src and apps"; fi
}

# Of a changed header, one source that includes it is checked: the one of the same name, or else the
# first that includes it, or includes a header that does.
source_that_includes() {
  local header=$1 written includer
  if [ -f "${header%.hpp}.cpp" ]; then
    echo "${header%.hpp}.cpp"
    return
  fi
  written=${header#src/}
  written=${written#tests/}
  written=${written#support/}
  written=${written#apps/tpm/}
  includer=$(git grep -lF "#include \"$written\"" -- '*.cpp' ':!tests/consumer' ':!tests/measure' | head -n 1 || true)
  if [ -n "$includer" ]; then
    echo "$includer"
    return
  fi
  includer=$(git grep -lF "#include \"$written\"" -- '*.hpp' | head -n 1 || true)
  [ -z "$includer" ] || source_that_includes "$includer"
}

# tidy_changed BUILD_FOLDER: the folder of a build that compiles each file alone
tidy_changed() {
  local build=$1 base file
  base=$(tidy_base)
  {
    if [ -z "$base" ]; then
      git ls-files 'src/*.cpp' 'apps/*.cpp'
    else
      git diff --name-only --diff-filter=d "$base" -- 'src/*.cpp' 'apps/*.cpp' 'tests/*.cpp'
      git diff --name-only --diff-filter=d "$base" -- 'src/*.hpp' 'apps/*.hpp' 'tests/*.hpp' |
        while read -r file; do source_that_includes "$file"; done
    fi
  } | sed -e "s|^$PWD/||" -e '/^tests\/consumer\//d' -e '/^apps\/peers\//d' | sort -u |
    xargs --no-run-if-empty --max-procs="$(nproc)" --max-args=1 \
      clang-tidy --quiet -p "$build" --extra-arg=-Wno-unknown-warning-option \
      2> >(grep -v 'warnings\? generated' >&2) ||
    die "clang-tidy found the faults above"
}
