#!/usr/bin/env bash
# Slurm 22.05.8 (Debian 12), one node, no accounting.
#
# `scancel` of an array task sends SIGTERM, and so does the end of its time; a batch script that traps it and calls
# `scontrol requeue` is how checkpoints are done. One would expect that a task whose user has cancelled it stays cancelled,
# and that a task that requeues itself is eligible at once.
#
# It is put back into the queue like any other (exit code 0, JobState=PENDING, Restarts=1), and is eligible 121 seconds
# later, whatever the priorities: a script must look at its JobState first, which is COMPLETING after scancel and RUNNING
# before the end of its time.
set -uo pipefail
version=22.05.8-4+deb12u3
[ "$(id -u)" -eq 0 ] || { echo "not run: Slurm's daemons need root here"; exit 0; }
work=$(mktemp -d)
daemons=()
trap 'kill "${daemons[@]}" 2>/dev/null; wait "${daemons[@]}" 2>/dev/null; rm -rf "$work"' EXIT
cd "$work" || exit 1
chmod 711 "$work"
# Debian's packages, unpacked here and not installed.
packages="slurmctld slurmd slurm-client slurm-wlm-basic-plugins"
wanted=""
for package in $packages; do wanted="$wanted $package=$version"; done
others=$(apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces --no-enhances $packages munge 2>/dev/null |
    grep -E '^(lib|munge)' | grep -E '^(libmunge2|munge|libhwloc15|libjson-c5|libjwt0|libyaml-0-2|libhttp-parser2.9|liblua5.3-0|libfreeipmi17|libipmimonitoring6|librrd8|libnuma1|liblz4-1|libpam0g|libdbus-1-3|libjansson4|librdkafka1|libpmix2|libcurl4|libreadline8)$' | sort -u)
# shellcheck disable=SC2086 # Words are words.
apt-get download -qq $wanted $others >/dev/null 2>&1 || { echo "not run: the packages of $version cannot be had"; exit 0; }
for package in *.deb; do dpkg-deb -x "$package" root; done
libraries=$(find "$work/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
plugins=$(dirname "$(find "$work/root" -name select_cons_tres.so | head -1)")
export LD_LIBRARY_PATH=$libraries SLURM_CONF=$work/slurm.conf
PATH=$work/root/usr/bin:$work/root/usr/sbin:$PATH
mkdir -p state spool munge
chmod 700 munge
dd if=/dev/urandom of=munge/key bs=1024 count=1 2>/dev/null
chmod 400 munge/key
munged --foreground --force --socket "$work/socket" --key-file "$work/munge/key" --pid-file "$work/munge/pid" \
    --log-file "$work/munge/log" --seed-file "$work/munge/seed" >/dev/null 2>&1 &
daemons+=($!)
host=$(hostname -s)
cat >slurm.conf <<CONF
ClusterName=finding
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/socket
PluginDir=$plugins
SlurmctldPort=$((20000 + RANDOM % 9000))
SlurmdPort=$((30000 + RANDOM % 9000))
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000
PartitionName=main Nodes=ALL Default=YES State=UP
CONF
sleep 1
slurmctld -D >ctld.log 2>&1 & daemons+=($!)
slurmd -D -N "$host" >d.log 2>&1 & daemons+=($!)
for _ in $(seq 60); do [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break; sleep 0.5; done
[ "$(sinfo -h -o %T 2>/dev/null)" = idle ] || { echo "not run: no node: $(tail -n 1 ctld.log) $(tail -n 1 d.log)"; exit 0; }
cat >task.sh <<'TASK'
#!/bin/bash
#SBATCH --array=1-1
#SBATCH --requeue
id=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
trap 'scontrol --oneliner show job $id | grep -o "JobState=[A-Z]*" >state.txt; scontrol requeue $id; exit 7' TERM
sleep 60 & wait
TASK
array=$(sbatch --parsable task.sh)
for _ in $(seq 40); do [ -n "$(squeue -h -t RUNNING)" ] && break; sleep 0.5; done
sleep 1
scancel "${array}_1"
sleep 4
seen=$(scontrol --oneliner show job "${array}_1")
field() { grep -o " $1=[^ ]*" <<<"$seen" | head -n 1 | cut -d= -f2; }
waits=$(($(date -d "$(field EligibleTime)" +%s) - $(date -d "$(field SubmitTime)" +%s)))
echo "slurm $(slurmctld -V): in the trap $(cat state.txt); after scancel: JobState=$(grep -o 'JobState=[A-Z]*' <<<"$seen" | cut -d= -f2) Restarts=$(field Restarts), eligible ${waits} s later"
[ "$(cat state.txt)" = JobState=COMPLETING ] && grep -q JobState=PENDING <<<"$seen" && [ "$(field Restarts)" = 1 ] && [ "$waits" -ge 120 ]
