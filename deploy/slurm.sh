#!/bin/sh
# A campaign as a Slurm array, a shard a task:
#
#   sbatch --array=0-99 deploy/slurm.sh /shared/out /path/to/tractive-rig campaign --random 1000000
#
# The folder and the program are the same for every task. What was cut off is started again with the same line: shards that are
# done stay. Then: tractive-rig campaign --merge /shared/out --out /shared/merged
#SBATCH --job-name=tractive-campaign
#SBATCH --ntasks=1
#SBATCH --requeue
set -eu
folder=$1
shift
count=$((SLURM_ARRAY_TASK_MAX + 1))
RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
export RAYON_NUM_THREADS
exec "$@" --out "$folder" --shard "$SLURM_ARRAY_TASK_ID/$count"
