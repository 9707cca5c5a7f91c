#!/usr/bin/env bash
# Renders a film with a real Slurm on the loopback interface, with a node that fails during the film:  slurm.sh OFFSTAGE SOURCE_DIR
# Starts munged, slurmctld and two slurmd as the present user, which must be root, with files in a separate folder.
set -euo pipefail
offstage=$(realpath "$1")
scene=$(realpath "$2")/tests/data/tiny.json
for program in munged slurmctld slurmd sbatch squeue; do
  command -v $program >/dev/null || { echo "$program is missing: apt-get install slurm-wlm munge"; exit 1; }
done
work=$(mktemp -d)
chmod 755 "$work"
pids=()
stop() {
  for pid in $(cat "$work"/*.pid 2>/dev/null) "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  sleep 1
  for pid in $(cat "$work"/*.pid 2>/dev/null) "${pids[@]}"; do kill -9 "$pid" 2>/dev/null || true; done
  [ -n "${KEEP:-}" ] || rm -rf "$work"
}
trap stop EXIT
fail() { echo "$1"; tail -n 20 "$work"/*.log "$work"/film.mp4.farm/logs/*.log 2>/dev/null; exit 1; }

mkdir -m 700 "$work/munge" "$work/state" "$work/spool-a" "$work/spool-b"
head -c 1024 /dev/urandom >"$work/munge/key"
chmod 400 "$work/munge/key"
munged --force --foreground --key-file="$work/munge/key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
  --log-file="$work/munged.log" --seed-file="$work/munge/seed" >"$work/munged.out.log" 2>&1 &
pids+=($!)

port=$((20000 + $$ % 20000))
host=$(hostname -s)
cat >"$work/slurm.conf" <<CONF
ClusterName=offstage
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=1
SlurmdTimeout=10
InactiveLimit=0
KillWait=2
MinJobAge=300
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
StateSaveLocation=$work/state
SlurmctldPidFile=$work/slurmctld.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdPidFile=$work/slurmd-%n.pid
SlurmdLogFile=$work/slurmd-%n.log
SlurmdSpoolDir=$work/spool-%n
NodeName=a NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 State=UNKNOWN
NodeName=b NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 State=UNKNOWN
PartitionName=render Nodes=a,b Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
for _ in $(seq 50); do [ -S "$work/munge.socket" ] && break; sleep 0.1; done
slurmctld -D >"$work/slurmctld.out.log" 2>&1 &
pids+=($!)
slurmd -D -N a >"$work/a.out.log" 2>&1 &
pids+=($!)
slurmd -D -N b >"$work/b.out.log" 2>&1 &
node_b=$!
pids+=($node_b)
for _ in $(seq 60); do [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 2 ] && break; sleep 0.5; done
[ "$(sinfo -h -t idle -o %D)" = 2 ] || fail "the nodes did not come up"

cd "$work"
"$offstage" render "$scene" -o direct.mp4 -q
# Each chunk takes three seconds, so that the node dies while it draws.
cat >slow.sh <<SH
#!/bin/sh
case "\$*" in *--chunk*) sleep 3 ;; esac
exec $offstage "\$@"
SH
chmod +x slow.sh
"$offstage" farm "$scene" -o film.mp4 --slurm --partition render --chunks 6 --threads 1 --program "$work/slow.sh" \
  --sbatch=--export=ALL

# Kills a node with its job while both nodes draw.
for _ in $(seq 240); do
  [ "$(squeue -h -t R -n film-chunk -o %N 2>/dev/null | sort -u | wc -l)" = 2 ] && break
  sleep 0.25
done
[ "$(squeue -h -t R -n film-chunk -o %N | sort -u | wc -l)" = 2 ] || fail "the chunks did not run on both nodes"
"$offstage" farm --status film.mp4.farm >status.txt || true
grep -q 'simulation: done' status.txt && grep -q RUNNING status.txt || fail "the status is wrong: $(cat status.txt)"
dying=$(squeue -h -t R -w b -o %A | head -1)
steps=$(pgrep -f "slurmstepd: \[$dying\." || true)
kill -9 $node_b
for step in $steps; do
  pkill -9 -P "$step" || true
  kill -9 "$step" || true
done
echo "node b died with job $dying"
scontrol update NodeName=b State=DOWN Reason="killed by the test"

for _ in $(seq 480); do [ -e film.mp4.farm/done/film ] && break; sleep 0.5; done
[ -e film.mp4.farm/done/film ] || { squeue; fail "the film did not come out"; }
cmp film.mp4 direct.mp4 || fail "the film differs"
"$offstage" farm --status film.mp4.farm
echo "the same bytes, without node b"
