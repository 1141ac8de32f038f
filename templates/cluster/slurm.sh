#!/bin/bash
#SBATCH --job-name=frobs
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=1
#SBATCH --cpus-per-task=16
#SBATCH --exclusive
#SBATCH --time=04:00:00
#SBATCH --output=frobs-%j.log
#SBATCH --requeue

# Train ten seeds on four machines: sbatch slurm.sh
# Submit it from a folder that all machines share, with a virtual environment .venv that contains FRobs and frobs-ray.
# If the time limit ends the job, submit it again: finished seeds are kept, and the others continue.

set -euo pipefail
source .venv/bin/activate

port=6379
head=$(scontrol show hostnames "$SLURM_JOB_NODELIST" | head -n 1)
# The first address of the head node. If it has several networks, choose the one that the other machines reach.
address=$(srun --nodes=1 --ntasks=1 --nodelist="$head" hostname --all-ip-addresses | awk '{ print $1 }')

# Every process of this job needs the same token. Slurm passes the variables on to all machines.
RAY_AUTH_TOKEN=$(python -c 'import secrets; print(secrets.token_hex(32))')
export RAY_AUTH_MODE=token RAY_AUTH_TOKEN
export RAY_SYMMETRIC_RUN_CLUSTER_WAIT_TIMEOUT=300 # [s] for all machines to join
export OMP_NUM_THREADS=1

# Start Ray on every machine, run the command on the first one, and stop Ray everywhere when it ends.
srun --nodes="$SLURM_JOB_NUM_NODES" --ntasks="$SLURM_JOB_NUM_NODES" --cpus-per-task="$SLURM_CPUS_PER_TASK" \
  ray symmetric-run --address "$address:$port" --min-nodes "$SLURM_JOB_NUM_NODES" \
  --num-cpus="$SLURM_CPUS_PER_TASK" --include-dashboard=false --disable-usage-stats -- \
  frobs train frobs/Irb120Reach-v0 --seeds 10 --runner ray --ray-address "$address:$port" \
  --run-dir runs/reach --on-existing resume
