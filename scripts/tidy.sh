# shellcheck shell=bash
# Sourced by check.sh: clang-tidy on the sources that changed since a base commit, in more than includes and namespaces.

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

# Lines that say what a file does: without includes, namespaces and blanks, which a move changes.
lines_that_count() {
  grep -vE '^(#include |(using )?namespace |\}+  // namespace|// Declared in |$)' || true
}

# changed_since BASE PATTERN...: files that are new or differ in more than lines_that_count() leaves out.
changed_since() {
  local base=$1 status old new
  shift
  git -c diff.renameLimit=20000 diff --name-status -M50 --diff-filter=d "$base" -- src apps tests include |
    while IFS=$'\t' read -r status old new; do
      case $status in
        R*) ;;
        A*) new=$old old= ;;
        *) new=$old ;;
      esac
      # shellcheck disable=SC2254
      for pattern in "$@"; do
        case $new in
          $pattern)
            if [ -z "$old" ] || ! cmp -s <(git show "$base:$old" | lines_that_count) <(lines_that_count <"$new"); then
              echo "$new"
            fi
            ;;
        esac
      done
    done
}

# tidy_changed BUILD_FOLDER: the folder of a build that compiles each file alone
tidy_changed() {
  local build=$1 base file
  base=$(tidy_base)
  {
    if [ -z "$base" ]; then
      git ls-files 'src/*.cpp' 'apps/*.cpp'
    else
      changed_since "$base" 'src/*.cpp' 'apps/*.cpp' 'tests/*.cpp'
      changed_since "$base" 'src/*.hpp' 'apps/*.hpp' 'tests/*.hpp' |
        while read -r file; do source_that_includes "$file"; done
    fi
  } | sed -e "s|^$PWD/||" -e '/^tests\/consumer\//d' -e '/^apps\/peers\//d' | sort -u |
    xargs --no-run-if-empty --max-procs="$(nproc)" --max-args=1 \
      clang-tidy --quiet -p "$build" --extra-arg=-Wno-unknown-warning-option \
      2> >(grep -v 'warnings\? generated' >&2) ||
    die "clang-tidy found the faults above"
}
