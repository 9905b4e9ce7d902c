#!/usr/bin/env bash
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=1
#SBATCH --exclusive
# Renders on the nodes of a Slurm job, which it turns into a Ray cluster for as long as that takes:
#   sbatch --nodes 8 pipeline/cluster/slurm.sh shot.usda -o shot.exr --resume -p 1024
# Ray and kilauea[cluster] are installed on all nodes, and the stage is where all of them see it.
set -euo pipefail

port=${KILAUEA_RAY_PORT:-6379}
head=$(scontrol show hostnames "$SLURM_JOB_NODELIST" | head -n 1)
head_ip=$(srun --nodes 1 --ntasks 1 --nodelist "$head" hostname --ip-address | awk '{print $1}')

# Nobody else may join: a token that only this job's nodes get, from the environment of srun.
export RAY_AUTH_MODE=token
RAY_AUTH_TOKEN=$(head --bytes 32 /dev/urandom | od -An -tx1 | tr -d ' \n')
export RAY_AUTH_TOKEN

# A lost machine is noticed by its links within two seconds; Ray then needs to know it as well.
export RAY_health_check_period_ms=1000 RAY_health_check_timeout_ms=1000
export RAY_health_check_failure_threshold=3

srun --nodes 1 --ntasks 1 --nodelist "$head" \
    ray start --head --node-ip-address "$head_ip" --port "$port" --block &
until ray health-check --address "$head_ip:$port" 2>/dev/null; do sleep 1; done
if ((SLURM_JOB_NUM_NODES > 1)); then
    srun --nodes $((SLURM_JOB_NUM_NODES - 1)) --ntasks-per-node 1 --exclude "$head" \
        ray start --address "$head_ip:$port" --block &
fi
until [ "$(ray list nodes --address "$head_ip:$port" --filter state=ALIVE --format json |
    grep -c '"node_id"')" -ge "$SLURM_JOB_NUM_NODES" ]; do sleep 1; done

kilauea cluster doctor --cluster "$head_ip:$port"
kilauea render "$@" --cluster "$head_ip:$port"
