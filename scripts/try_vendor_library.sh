#!/usr/bin/env bash
# Walks the whole way to a haptic device through the vendor's library that you have: tpm hil devices, check, run, verify.
# Prints what tpm says, every call to the library whose answer is new, and how often each was made. Exit code 1 and
# "not run" without a library. The device renders nothing before the session's gate opens; hold it as for a session.
#
#   scripts/try_vendor_library.sh /opt/sdk/lib/release/lin-x86_64-gcc/libdrd.so.3
#   scripts/try_vendor_library.sh LIBRARY --device omega7 --may-move     options of tpm hil check and run
#   TPM_SESSION=my_session.json, TPM_BUILD=build/release choose what is run, TPM_RUN_OPTIONS="--device-file device.json" how
set -uo pipefail
cd "$(dirname "$0")/.."

library=${1:-}
[[ -n "$library" ]] && shift
build=${TPM_BUILD:-build/release}
session=${TPM_SESSION:-configs/hil_omega7.json}
if [[ -z "$library" || ! -e "$library" ]]; then
  echo "not run: no vendor library${library:+ at $library}; usage: scripts/try_vendor_library.sh LIBRARY [OPTION...]" >&2
  exit 1
fi
library=$(realpath "$library")
for file in "$build/tpm" "$build/tests/stand_in_dhd/libdhd_trace.so"; do
  [[ -e "$file" ]] || { echo "not run: $file is missing; build it with scripts/test.sh" >&2; exit 1; }
done
options=("$@")
[[ " ${options[*]} " == *" --device "* ]] || options=(--device omega7 "${options[@]}")

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export TPM_TRACED_LIBRARY=$library TPM_TRACE=$folder/trace
through=(--dhd-library "$build/tests/stand_in_dhd/libdhd_trace.so")
failed=()

walk() { # NAME TPM-ARGUMENT...
  local name=$1 code
  shift
  : >"$TPM_TRACE"
  echo "== tpm $*"
  "$build/tpm" "$@"
  code=$?
  echo "-- exit code $code$([[ -s $TPM_TRACE ]] && echo '; calls of the library:')"
  sed 's/^/   /' "$TPM_TRACE"
  [[ $code -eq 0 ]] || failed+=("$name")
}

walk devices hil devices "${through[@]}"
walk check hil check "$session" --duration "2 s" "${through[@]}" "${options[@]}"
walk run hil run "$session" -o "$folder/session.tpmrec" "${through[@]}" "${options[@]}" ${TPM_RUN_OPTIONS:-}
if [[ -e "$folder/session.tpmrec" ]]; then
  walk verify hil verify "$folder/session.tpmrec"
fi
if [[ ${#failed[@]} -gt 0 ]]; then
  echo "== did not go through: ${failed[*]}"
  exit 1
fi
echo "== went through: devices, check, run, verify"
