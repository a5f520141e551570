#!/bin/sh
# sbatch scripts/part.sh dynaskin COMMAND ...: runs a part of `dynaskin simulate` or `dynaskin fit-all` as a task of a
# Slurm job array that counts from 1, or of a Kubernetes indexed Job. PARTS is their number; Slurm tells it by itself
# where all of them are in the array.
#SBATCH --array=1-16
#SBATCH --cpus-per-task=2
#SBATCH --mem=4G
set -eu
if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
  part="$SLURM_ARRAY_TASK_ID/${PARTS:-$SLURM_ARRAY_TASK_COUNT}"
elif [ -n "${JOB_COMPLETION_INDEX:-}" ]; then
  # From 0.
  part="$((JOB_COMPLETION_INDEX + 1))/${PARTS:?is the number of parts}"
else
  echo "part.sh: neither SLURM_ARRAY_TASK_ID nor JOB_COMPLETION_INDEX is set: start it as an array job" >&2
  exit 2
fi
exec "$@" --shard "$part"
