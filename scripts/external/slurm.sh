#!/bin/bash
# A job array on a real Slurm of three nodes (scripts/slurm-testbed), of which one is killed and one cut off, while a shard is
# preempted and another comes to its time limit: the bits of a run on one machine. Each worker is held at work until its
# misfortune has hit it, so nothing depends on the speed of the machine. Workers compact the folder meanwhile. Then a job with a
# goal, submitted look by look.
#
#   slurm.sh PROGRAM FOLDER      writes below FOLDER; needs root, Slurm and oiiotool
set -euo pipefail

program=$(realpath "$1")
folder=$2
here=$(realpath "$(dirname "$0")")
# shellcheck source=bits.sh
source "$here/bits.sh"
export SLURM_TESTBED_DIR
SLURM_TESTBED_DIR=$(mktemp -d /tmp/slurm-XXXXXX)
testbed=$here/../slurm-testbed
farm="$folder/on a farm"
begun=$SECONDS

say() { echo "slurm, $((SECONDS - begun)) s: $*"; }
after() {
    (($? == 0)) || tail -n 20 "$farm"/slurm/*.log "$SLURM_TESTBED_DIR"/log/slurmctld.log >&2 || true
    "$testbed" down
    rm -rf "$SLURM_TESTBED_DIR"
}

"$program" run -q "$here/farm.toml" -o "$folder/one machine" >/dev/null
say "the run on one machine is done"

# Arrays of at most six tasks, so eight shards are two arrays.
trap after EXIT
"$testbed" up 3 MaxArraySize=6
eval "$("$testbed" env)"

"$program" submit "$here/farm.toml" -o "$farm" --engine slurm --time 1 --partition batch --compact 4 \
    --sbatch '--comment="a test"' |
    tee "$folder/said"
grep -qx 'job 1: shards 0-5' "$folder/said"
grep -qx 'job [0-9]*: shards 6-7' "$folder/said"
"$program" submit "$farm" --engine slurm | grep -q 'nothing to submit: shards 0-7 are queued or running (job 1, '

# Six shards at work, two on each node; each has a checkpoint and is held.
stale=()
for shard in {0..5}; do
    wait_until 60 "shard $shard is at work" held_at_work "$farm" "$shard"
    stale[shard]=$(worker_of "$farm" "$shard")
done
say "six shards are at work"
node() { squeue -h -r -j "1_$1" -t all -o %N; }
on() { for shard in {0..5}; do [[ $(node "$shard") == "$1" ]] && echo "$shard"; done; return 0; }
mapfile -t killed < <(on n1)
mapfile -t cut < <(on n2)
mapfile -t others < <(on n3)
((${#killed[@]} == 2 && ${#cut[@]} == 2 && ${#others[@]} == 2))

# Nobody will compute shard 7.
scancel 2_1

# A preview, while workers are at work.
code=0
"$program" merge "$farm" -o "$folder/preview" >"$folder/said" || code=$?
((code == 3)) && grep -q 'incomplete: batches ' "$folder/said"
"$program" status "$farm" | grep -q '^n3  *2 '

"$testbed" kill-node n1
"$testbed" cut-node n2
say "n1 killed with shards ${killed[*]}, n2 cut off with shards ${cut[*]}"
sbatch --parsable --partition=urgent --nodelist=n3 --time=1 --output=/dev/null --wrap 'sleep 1' >/dev/null

# One of the two on n3 is told to go (SIGTERM), the other that its time is nearly up (SIGUSR2); Slurm wakes them first.
was_preempted() { grep -qs 'checkpoint written, waiting to be ended' "$farm/slurm/1_$1.log"; }
one_preempted() { was_preempted "${others[0]}" || was_preempted "${others[1]}"; }
wait_until 40 "the preemption" one_preempted
if was_preempted "${others[0]}"; then preempted=${others[0]} late=${others[1]}; else preempted=${others[1]} late=${others[0]}; fi
say "shard $preempted preempted"
"$testbed" start-node n1
wait_until 60 "the warning before the time limit" grep -q 'time is up, to be requeued' "$farm/slurm/1_$late.log"
say "shard $late came to its time limit; n1 boots again"

# The workers on n2 wake when others have begun their shards: two on one shard, and both write.
attempts() { wc -l <"$farm/attempts/shard-00000$1.jsonl"; }
begun_again() { (($(attempts "$1") >= 2)); }
for shard in "${cut[@]}"; do
    wait_until 60 "shard $shard begins elsewhere" begun_again "$shard"
    kill -CONT "${stale[$shard]}"
done
say "shards ${cut[*]} have begun elsewhere; the workers on n2 wake up"

# The merge says what is missing, and another submission computes that alone.
ended() { [[ $(squeue -h -t all -j "$1" -o %T) =~ ^(COMPLETED|FAILED)$ ]]; }
wait_until 150 "the merge" ended 3
"$testbed" heal-node n2
[[ $(squeue -h -t all -j 3 -o %T) == FAILED ]]
grep -x 'shards 7 are missing; .*' "$farm/slurm/merge-3.log"
grep -qxF "  sbatch --array=1 '$farm/slurm/shards.sbatch' 6" "$farm/slurm/merge-3.log"
"$program" submit "$farm" --engine slurm --time 10 | tee "$folder/said"
job=$(sed -n 's/^job \([0-9]*\): shards 7$/\1/p' "$folder/said")
wait_until 100 "the second merge" ended $((job + 1))
say "merged"

for shard in "${killed[@]}" "${cut[@]}" "$preempted" "$late"; do
    begun_again "$shard" || { echo "shard $shard was not tried again" >&2; exit 1; }
done
grep -q 'attempt 2 on .* (Slurm job 1_.*, restart 1)' "$farm/slurm/1_$preempted.log"
grep -h 'attempt' "$farm"/slurm/*.log | sort
same_bits "$folder/one machine" "$farm" "the farm and one machine"
[[ -e $farm/shards/compacted.ckpt && ! -e $farm/shards/shard-000000.ckpt ]] || { echo "nothing was compacted" >&2; exit 1; }
say "the farm and one machine give the same bits"

aim="$folder/a goal"
"$program" run -q "$here/goal.toml" -o "$folder/a goal on one machine" >/dev/null
looks=0
while "$program" submit "$here/goal.toml" -o "$aim" --engine slurm --time 1 --partition batch >"$folder/said"; do
    if grep -q 'nothing to submit: no shard is missing' "$folder/said"; then break; fi
    grep -q 'up to the look at' "$folder/said"
    job=$(sed -n 's/^job \([0-9]*\): merge, after these$/\1/p' "$folder/said")
    wait_until 60 "the merge of a look" ended "$job"
    looks=$((looks + 1))
    ((looks <= 4)) || { echo "the goal is never reached" >&2; exit 1; }
done
((looks >= 2)) || { echo "the goal was reached at the first look: no second submission was needed" >&2; exit 1; }
same_bits "$folder/a goal on one machine" "$aim" "a goal on the farm and on one machine"
say "the goal was reached at look $looks, with the bits of one machine"
