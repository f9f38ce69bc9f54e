#!/bin/sh
# mpi_sweep.sh TPM: the same sweep by threads and under mpirun with 1, 2 and 4 processes gives the same
# bytes; one that was killed goes on; what goes wrong is told once.
set -eu
tpm=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat > s.json <<'JSON'
{"model": "single_contact", "material": {"eta1": "240 kPa s"}, "block": 777,
 "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"},
 "axes": [{"parameter": "depth", "from": "-1 mm", "to": "10 mm", "count": 110},
          {"parameter": "spacing", "from": "10 mm", "to": "40 mm", "count": 1000}],
 "skip": [{"when": "spacing > 0.039"}],
 "outputs": ["peak_force", "end_force"]}
JSON
run() { mpirun --allow-run-as-root --oversubscribe -n "$@"; }
"$tpm" sweep s.json -o threads.h5 > /dev/null
for n in 1 2 4; do
  run "$n" "$tpm" sweep s.json -o "ranks$n.h5" > /dev/null
  cmp threads.h5 "ranks$n.h5"
done
# Killed, with all its processes, and gone on with.
run 2 "$tpm" sweep s.json -o killed.h5 > /dev/null 2>&1 &
sleep 0.7
kill -9 $! 2> /dev/null || true
wait $! 2> /dev/null || true
sleep 1
run 4 "$tpm" sweep s.json -o killed.h5 > /dev/null 2>&1
cmp threads.h5 killed.h5
# One line of tpm from four processes (mpirun adds its own).
! run 4 "$tpm" sweep missing.json -o x.h5 2> said > /dev/null
test "$(grep -c 'tpm: missing.json: no such file' said)" = 1
echo "mpirun -n 1, 2, 4 and a killed run: the same bytes"
