#!/usr/bin/env bash
# A sweep on a cluster of this one machine: tasks, slurmd and the submitting program are killed at random times, and tasks are requeued;
# the table is nevertheless that of a run without a cluster. Root, munge and slurm-wlm are needed; ./start test-cluster installs them.
#   tests/cluster/run.sh PROGRAM [RUNS]      RUNS short runs, 1000 when absent
set -euo pipefail
program=$(realpath "$1")
runs=${2:-1000}
work=$(mktemp -d /tmp/trocar-cluster-XXXXXX)
chmod 755 "$work"
export SLURM_CONF=$work/slurm.conf TROCAR_CACHE=$work/cache
RANDOM=7
port=$((20000 + $$ % 20000))

stop_by_file() { # a daemon by the number that it has written, and only if it is ours
    local pid
    pid=$(cat "$1" 2>/dev/null || true)
    [[ -n $pid ]] && tr '\0' ' ' <"/proc/$pid/cmdline" 2>/dev/null | grep -q "$work" && kill "$2" "$pid" 2>/dev/null || true
}
stop() {
    for daemon in slurmd slurmctld munged; do stop_by_file "$work/$daemon.pid" -TERM; done
    sleep 1
    for daemon in slurmd slurmctld munged; do stop_by_file "$work/$daemon.pid" -KILL; done
    rm -rf "$work"
}
trap stop EXIT
fail() { echo "failed: $*" >&2; exit 1; }

start_cluster() {
    mkdir -p "$work"/{munge,state,spool,log,socket}
    chmod 700 "$work/munge"
    dd if=/dev/urandom of="$work/munge/munge.key" bs=1024 count=1 status=none
    chmod 600 "$work/munge/munge.key"
    munged --key-file="$work/munge/munge.key" --socket="$work/socket/munge.sock" --pid-file="$work/munged.pid" \
        --log-file="$work/munge/munged.log" --seed-file="$work/munge/munged.seed" --force
    local host
    host=$(hostname -s)
    cat >"$SLURM_CONF" <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/socket/munge.sock,cred_expire=5
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerParameters=batch_sched_delay=0,sched_interval=2,sched_min_interval=0,bf_interval=5
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
JobRequeue=1
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmdSpoolDir=$work/spool
StateSaveLocation=$work/state
SlurmctldLogFile=$work/log/slurmctld.log
SlurmdLogFile=$work/log/slurmd.log
KillWait=5
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/{print int($2/1024*0.9)}' /proc/meminfo) State=UNKNOWN
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP
END
    slurmctld -f "$SLURM_CONF"
    slurmd -f "$SLURM_CONF"
    for _ in $(seq 100); do sinfo -h -o %T 2>/dev/null | grep -qE 'idle|mixed|alloc' && return; sleep 0.2; done
    fail "the cluster does not come up: see $work/log"
}

workers() { # of this sweep's folder
    for entry in /proc/[0-9]*; do
        { tr '\0' ' ' <"$entry/cmdline"; } 2>/dev/null | grep -q "sweep-worker $work/" && echo "${entry#/proc/}"
    done || true
}

wait_for_queue() { # until nothing is in it
    for _ in $(seq 1200); do [[ -z $(squeue -h -r 2>/dev/null) ]] && return; sleep 0.5; done
    fail "the queue does not become empty"
}

cat >"$work/tube.json" <<'END'
{"units": {"length": "mm", "pressure": "MPa"}, "time": {"step": 0.01, "duration": 0.2}, "budget": "exact",
 "bodies": {"tube": {"kind": "static", "hollow": true, "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 120, 4]], "sides": 16}}},
 "instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 60, "segment": 5, "skin_triangles": 600,
   "tip": {"shape": "J", "length": 12, "angle": 0.6}, "lumen": "tube",
   "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [0.2, 26, 0.4]]}},
 "effects": ["coarse_contact", "exact_contact", "friction"]}
END
cat >"$work/sweep.json" <<END
{"scene": "tube.json", "repeat": $((runs / 4)), "vary": {"/instruments/wire/friction": {"from": 0, "to": 0.3, "count": 4}},
 "collect": {"hash": "/state_hash", "force": {"column": "max_contact_force_n", "take": "max"}}}
END
sweep=("$program" sweep "$work/sweep.json" --quiet --out)

start_cluster
begin=$(date +%s.%N)
"${sweep[@]}" "$work/local" --jobs "$(nproc)" --collect "$work/local.csv"
echo "without a cluster: $(awk "BEGIN {print $(date +%s.%N) - $begin}") s"

begin=$(date +%s.%N)
"${sweep[@]}" "$work/clean" --slurm
wait_for_queue
"${sweep[@]}" "$work/clean" --collect "$work/clean.csv"
cmp "$work/local.csv" "$work/clean.csv" || fail "the table of the cluster differs"
echo "on the cluster: $(awk "BEGIN {print $(date +%s.%N) - $begin}") s"

"${sweep[@]}" "$work/cut" --slurm
for round in 1 2 3 4 5 6 7 8; do
    sleep "$((RANDOM % 3)).$((RANDOM % 10))"
    case $((round % 4)) in
    0) for pid in $(workers); do kill -KILL "$pid" 2>/dev/null || true; done ;;
    1) stop_by_file "$work/slurmd.pid" -KILL; sleep 0.5; slurmd -f "$SLURM_CONF" ;;
    3) for task in $(squeue -h -r -t R -o %i); do scontrol requeue "$task" || true; done ;; # as a preemption does
    2) "${sweep[@]}" "$work/cut" --slurm --resume --no-forecast & submitter=$!
       sleep "0.$((RANDOM % 4))"; kill -KILL $submitter 2>/dev/null || true; wait $submitter 2>/dev/null || true ;;
    esac
    "${sweep[@]}" "$work/cut" --status | head -n 1
done
for _ in 1 2 3 4 5; do
    wait_for_queue
    "${sweep[@]}" "$work/cut" --status | grep -q " 0 running, 0 missing" && break
    "${sweep[@]}" "$work/cut" --slurm --resume
done
wait_for_queue
"${sweep[@]}" "$work/cut" --collect "$work/cut.csv"
cmp "$work/local.csv" "$work/cut.csv" || fail "the table of what was killed and resumed differs"
echo "passed: $runs runs, the same table without a cluster, on it, with tasks, slurmd and the submitting program killed, and requeued"
