#!/bin/sh
# A full disk, a folder that cannot be written, a damaged result and a damaged log, as they are: file
# systems in memory, in a mount namespace of their own. sweep_faults.sh TPM; 77 where that is not allowed.
set -eu
if [ "${2:-}" != inside ]; then
  if ! unshare -m --propagation private true 2>/dev/null; then
    echo "no mount namespace for this user: skipped"
    exit 77
  fi
  work=$(mktemp -d)
  code=0
  unshare -m --propagation private "$0" "$1" inside "$work" || code=$?
  rmdir "$work"
  exit "$code"
fi
tpm=$1
work=$3
mount -t tmpfs -o size=32m tmpfs "$work" || exit 77
cd "$work"
mkdir disk
mount -t tmpfs -o size=8m tmpfs disk || exit 77
head -c 8081408 /dev/zero >disk/filler  # 300 kB are left

fail() {
  echo "sweep_faults.sh: $1" >&2
  cat said >&2
  exit 1
}
# What a command says on stderr is one line, and its exit code is the one expected.
refused() {
  expected=$1
  shift
  code=0
  "$@" >out 2>said || code=$?
  [ "$code" -eq "$expected" ] || fail "exit code $code in place of $expected: $*"
  [ "$(wc -l <said)" -eq 1 ] || fail "not one line: $*"
  echo "exit $code: $(cat said)"
}

cat >sweep.json <<'END'
{"model": "single_contact", "material": {"eta1": "240 kPa s"},
 "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"}, "block": 500,
 "axes": [{"parameter": "depth", "from": "0.1 mm", "to": "10 mm", "count": 40},
          {"parameter": "spacing", "from": "10 mm", "to": "40 mm", "count": 500}],
 "outputs": ["peak_force", "end_force"]}
END
"$tpm" sweep sweep.json -o whole.h5 >out

echo "a disk with 300 kB left"
refused 5 "$tpm" sweep sweep.json -o disk/a.h5
[ ! -e disk/a.h5 ] || fail "a result without room"
kept=$(wc -c <disk/a.h5.blocks)
[ "$kept" -gt 200000 ] || fail "only $kept bytes kept"
echo "there is room again"
rm disk/filler
"$tpm" sweep sweep.json -o disk/a.h5 >out
cmp disk/a.h5 whole.h5 || fail "another result after the full disk"
grep -q '"blocks_found_in_the_log": [1-9]' disk/a.run.json || fail "what was kept was not used"

echo "a folder that cannot be written"
"$tpm" sweep sweep.json -o disk/b.h5 --shard 1/2 >out
sha256sum disk/* >before
mount -o remount,ro disk
refused 5 "$tpm" sweep sweep.json -o disk/c.h5
refused 5 "$tpm" sweep sweep.json -o disk/b.h5 --shard 2/2
sha256sum -c --quiet before || fail "files in the folder changed"
mount -o remount,rw disk
"$tpm" sweep sweep.json -o disk/b.h5 --shard 2/2 >out
"$tpm" sweep merge sweep.json -o disk/b.h5 >out
cmp disk/b.h5 whole.h5 || fail "another result after the folder"

echo "a result that is damaged"
size=$(wc -c <whole.h5)
for part in 20 2000 $((size / 2)) $((size - 100)); do
  head -c "$part" whole.h5 >cut.h5
  refused 3 "$tpm" sweep show cut.h5
done
"$tpm" sweep sweep.json -o cut.h5 >out
cmp cut.h5 whole.h5 || fail "the damaged result was not made anew"
at=0
while [ "$at" -lt 20000 ]; do
  cp whole.h5 bad.h5
  printf '\377\001\377\001' | dd of=bad.h5 bs=1 seek="$at" conv=notrunc 2>/dev/null
  code=0
  "$tpm" sweep show bad.h5 >out 2>said || code=$?
  { [ "$code" -eq 3 ] && [ "$(wc -l <said)" -eq 1 ]; } ||
    fail "exit code $code with byte $at of the result damaged"
  at=$((at + 1009))
done
cat said

echo "a log that is damaged"
"$tpm" sweep sweep.json -o d.h5 --shard 1/1 >out
cp d.h5.shard-1-of-1 log
printf 'damaged' | dd of=log bs=1 seek=100000 conv=notrunc 2>/dev/null
cp log e.h5.blocks
"$tpm" sweep sweep.json -o e.h5 >out 2>said
grep -v "blocks of the sweep" said
cmp e.h5 whole.h5 || fail "another result after the damaged log"
grep -q '"blocks_found_in_the_log": 39' e.run.json || fail "more than a block was lost"
head -c 100 log >f.h5.blocks
"$tpm" sweep sweep.json -o f.h5 >out 2>said
cmp f.h5 whole.h5 || fail "another result after the cut log"
printf 'something else altogether' >g.h5.blocks
refused 3 "$tpm" sweep sweep.json -o g.h5
[ "$(cat g.h5.blocks)" = "something else altogether" ] || fail "somebody's file was overwritten"
echo "nothing was lost"
