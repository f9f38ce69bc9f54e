#!/usr/bin/env bash
# Runs a sweep as a job array under a real Slurm, set up on this machine for that alone, and compares what
# the merged shards hold with what one process finds: byte for byte.
#
#     scripts/try_slurm.sh [SWEEP.json [TASKS]]        default configs/sweep_x_depth.json, 4 tasks
#
# Installs Debian's slurm-wlm and munge if they are missing (root or sudo). The daemons belong to this
# user, talk over the loopback alone, keep everything in one temporary folder, and end with the script.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

sweep=$(realpath "${1:-configs/sweep_x_depth.json}")
tasks=${2:-4}
[[ $tasks =~ ^[1-9][0-9]*$ ]] || die "TASKS is '$tasks'; expected a whole number above 0"
install_missing "to run a sweep under Slurm" slurmctld slurmd slurm-client munge
TPM=$(realpath "${TPM:-build/release/tpm}")
[[ -x $TPM ]] || die "there is no program $TPM; scripts/run.sh builds it, TPM=FILE names another"
export TPM PATH="$PATH:/usr/sbin"

folder=$(mktemp -d)
chmod 755 "$folder"
end() {
  local daemon pid
  for daemon in slurmd slurmctld munged; do
    if [[ -s $folder/$daemon.pid ]]; then
      pid=$(<"$folder/$daemon.pid")
      kill "$pid" 2>/dev/null || true
      timeout 10 tail --pid="$pid" -f /dev/null || true
    fi
  done
  rm -rf "$folder"
}
trap end EXIT

# failed WHAT: the last words of its tasks and of the daemons, then the end.
failed() {
  tail -n 5 "$folder"/slurm-*.out "$folder/slurmctld.log" "$folder/slurmd.log" >&2 || true
  die "$1 failed (its words stand above)"
}

host=$(hostname -s)
me=$(id -un)
mkdir -p "$folder"/{state,spool}
mkdir -m 700 "$folder/munge"
head -c 1024 /dev/urandom >"$folder/munge/key"
chmod 400 "$folder/munge/key"
cat >"$folder/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$me
SlurmdUser=$me
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
SlurmctldPort=${TPM_SLURM_PORT:-26817}
SlurmdPort=$((${TPM_SLURM_PORT:-26817} + 1))
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf

say "starting munged, slurmctld and slurmd ($(slurmctld -V))"
munged --force --key-file="$folder/munge/key" --socket="$folder/munge.socket" \
  --pid-file="$folder/munged.pid" --log-file="$folder/munge/log" --seed-file="$folder/munge/seed"
slurmctld
slurmd
for _ in $(seq 60); do
  state=$(sinfo --noheader --format=%T 2>/dev/null || true)
  [[ $state == idle* ]] && break
  sleep 0.5
done
[[ $state == idle* ]] || { tail -n 20 "$folder/slurmctld.log" "$folder/slurmd.log" >&2; die "the node is '$state', not idle"; }

say "a job array of $tasks tasks"
sbatch --wait --cpus-per-task=1 --chdir="$folder" --array="1-$tasks" scripts/sweep.sbatch "$sweep" "$folder/array.h5" ||
  failed "the job array"
again=$((tasks > 2 ? 3 : tasks))
say "the shard of task $again removed, and that task submitted again alone"
rm "$folder/array.h5.shard-$again-of-$tasks"*
sbatch --wait --cpus-per-task=1 --chdir="$folder" --array="$again" scripts/sweep.sbatch "$sweep" "$folder/array.h5" ||
  failed "the task submitted again"
[[ -s $folder/array.h5.shard-$again-of-$tasks ]] || die "task $again did not compute its shard"
say "merging"
"$TPM" sweep merge "$sweep" -o "$folder/array.h5"
say "the same in one process"
"$TPM" sweep "$sweep" -o "$folder/one.h5"
cmp "$folder/array.h5" "$folder/one.h5"
say "a job array of $tasks tasks under $(slurmctld -V) and one process give the same file, byte for byte"
