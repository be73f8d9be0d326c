#!/bin/sh
# Runs a campaign as a Slurm array on this machine, with a munged, a slurmctld and a slurmd of its own, kills a shard in the middle,
# starts it again, and compares the merged bytes with those of one run: deploy/test-slurm.sh PROGRAM FOLDER
#
# Exit code 0: the same bytes; 1: others, or something failed; 3: there is no Slurm here, or no right to run it.
set -eu
program=$(realpath "$1")
mkdir -p "$2"
folder=$(realpath "$2")
here=$(dirname "$(realpath "$0")")
runs=1200
words="campaign --random $runs --seed 7"
shards=4

PATH=$PATH:/usr/sbin
for name in munged slurmctld slurmd sbatch squeue scancel; do
    command -v "$name" >/dev/null || { echo "$name is not installed (Debian: apt-get install slurm-wlm)"; exit 3; }
done
[ "$(id -u)" = 0 ] || { echo "needs root, as slurmd does"; exit 3; }

rm -rf "${folder:?}"/* && mkdir -p "$folder/state" "$folder/spool" "$folder/shards"
daemons=
stop() {
    for pid in $daemons; do kill "$pid" 2>/dev/null || true; done
}
trap stop EXIT

# Its own key and socket: a munged of the machine's is left alone.
dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 status=none
chmod 600 "$folder/munge.key" && chmod 755 "$folder"
munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munge.pid" \
    --log-file="$folder/munged.log" --seed-file="$folder/munge.seed" &
daemons="$daemons $!"

cat > "$folder/slurm.conf" <<CONF
ClusterName=tractive
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$folder/slurm.conf"
slurmctld -D -f "$SLURM_CONF" >/dev/null 2>&1 &
daemons="$daemons $!"
slurmd -D -f "$SLURM_CONF" >/dev/null 2>&1 &
daemons="$daemons $!"

# until COMMAND is true, at most some minutes
await() {
    tries=0
    until eval "$1"; do
        tries=$((tries + 1))
        [ $tries -lt 3000 ] || { echo "waited in vain until $1"; tail -n 20 "$folder"/slurm*.log; exit 1; }
        sleep 0.2
    done
}
await 'sinfo --noheader --format=%T 2>/dev/null | grep -q idle'

# As the job file says, but where only the tests' output goes.
start() {
    sbatch --parsable --output="$folder/job-%a.txt" --array="$1" "$here/slurm.sh" "$folder/shards" "$program" $words
}
job=$(start "0-$((shards - 1))%2")
# The first shard is killed in the middle: when its file is there and not whole.
part="$folder/shards/shard-0-of-$shards.csv"
await '[ -e "$part" ]'
scancel --signal=KILL "${job}_0" || { echo "shard 0 was done before it could be killed"; exit 1; }
await '[ -z "$(squeue --noheader --jobs="$job" 2>/dev/null)" ]'
rows=$(($(wc -l < "$part") - 2))
whole=$((runs / shards))
echo "shard 0 was killed after $rows of $whole runs"
[ "$rows" -lt "$whole" ] || { echo "shard 0 was done before it was killed"; exit 1; }
if "$program" merge "$folder/shards" --out "$folder/merged" >/dev/null 2>"$folder/refused.txt"; then
    echo "merged with a gap"
    exit 1
fi
cat "$folder/refused.txt"
# Again: the array has to have all its tasks, for their count; those that are done stay.
job=$(start "0-$((shards - 1))%2")
await '[ -z "$(squeue --noheader --jobs="$job" 2>/dev/null)" ]'
cat "$folder"/job-*.txt
# Whether a run fails is the campaign's affair: exit code 1 tells that, 2 that there was no campaign.
for way in merge whole; do
    code=0
    if [ $way = merge ]; then
        "$program" merge "$folder/shards" --out "$folder/merged" >"$folder/merge.txt" 2>&1 || code=$?
    else
        "$program" $words --out "$folder/whole" >"$folder/whole.txt" 2>&1 || code=$?
    fi
    [ $code -le 1 ] || { cat "$folder/$way.txt"; exit 1; }
done
cmp "$folder/merged/campaign.csv" "$folder/whole/campaign.csv"
echo "the same $(wc -c < "$folder/whole/campaign.csv") bytes"
