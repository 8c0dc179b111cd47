#!/bin/sh
# Runs a sweep on Slurm, by one array for each stage of its plan: sh sweep.sh SPEC.toml STORE [OPTION OF sbatch ...]
# The store, the spec's files and this script must be in folders that all nodes share.
set -eu
if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    # Task i of n runs lines i + 1, i + 1 + n, ...
    status=0 again=
    while IFS= read -r job; do
        [ -n "$job" ] || continue
        one=0
        printf '%s\n' "$job" | actq job - --store "$2" || one=$?
        # 75, or a signal: another try may succeed.
        if [ "$one" = 75 ] || [ "$one" -gt 127 ]; then again=yes; elif [ "$one" != 0 ]; then status=$one; fi
    done <<JOBS
$(awk -v task="$SLURM_ARRAY_TASK_ID" -v tasks="$SLURM_ARRAY_TASK_COUNT" '(NR - 1) % tasks == task' "$1")
JOBS
    # Jobs that have a result do nothing then.
    if [ -n "$again" ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then
        scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
    fi
    if [ -n "$again" ] && [ "$status" = 0 ]; then status=75; fi
    exit "$status"
fi
spec=$1 store=${2%/}
shift 2
mkdir -p "$store"
actq plan "$spec" > "$store.jsonl"
stage=0 after=
while [ -n "$(actq plan "$store.jsonl" --stage $stage)" ]; do
    actq plan "$store.jsonl" --stage $stage --missing "$store" > "$store-$stage.jsonl"
    tasks=$(wc -l < "$store-$stage.jsonl")
    # Slurm's MaxArraySize is 1001 by default.
    if [ "$tasks" -gt 1000 ]; then tasks=1000; fi
    if [ "$tasks" -gt 0 ]; then
        after=--dependency=afterany:$(sbatch --parsable --requeue $after --array=0-$((tasks - 1)) "$@" "$0" "$store-$stage.jsonl" "$store")
    fi
    stage=$((stage + 1))
done
