#!/usr/bin/env bash
# A dataset as a Slurm array job: every task makes its shard, and a task that is killed goes on where it stopped when it is run again.
#
#   job=$(sbatch --parsable --array=1-100 scripts/cluster/slurm.sh --config my.toml --count 100000 --out /shared/data)
#   sbatch --dependency=afterok:$job --wrap "qpgen merge /shared/data"
#
# Tasks that failed: `qpgen merge` names them. Run task 7 again with: scontrol requeue JOB_7
# or, once Slurm has forgotten the job, with its place alone and the number of tasks said:
#   sbatch --array=6 --export=ALL,QUADPIXEL_SHARDS=100 scripts/cluster/slurm.sh ...   (places count from 0 then)
#
# The folder must be on a file system that all nodes see; so should the cache of angular responses (QUADPIXEL_CACHE). Response tables
# share their directions in the same way: sbatch --array=1-20 --wrap "qpgen response --model fdtd --pixel 2.8um", then the same
# command once with --shard 1/1.
#SBATCH --job-name=quadpixel
#SBATCH --cpus-per-task=2
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=quadpixel-%A_%a.log
set -euo pipefail
exec "${QPGEN:-qpgen}" dataset --threads "${SLURM_CPUS_PER_TASK:-1}" --json "$@"
