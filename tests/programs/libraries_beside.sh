#!/bin/sh
# libraries_beside.sh TPM: the program loads no library from the folder in which it is called, where anybody may have
# put one.
set -eu
tpm=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
names=$(ldd "$tpm" | awk '/=>/ {print $1}')
[ -n "$names" ]
for name in $names; do : > "$name"; done
"$tpm" version > /dev/null
