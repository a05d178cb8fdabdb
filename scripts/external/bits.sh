# For scripts that compare results: all that must be the same in a folder of results, a line each. Needs oiiotool.

bits() {  # FOLDER
    python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["results_digest"])' "$1/summary.json"
    local file
    for file in "$1"/*.exr; do
        oiiotool --hash "$file" | grep SHA-1 | sed "s|.*SHA-1|$(basename "$file") SHA-1|"
    done
    (cd "$1" && sha256sum -- *.csv)
}

same_bits() {  # FOLDER FOLDER WHAT
    diff <(bits "$1") <(bits "$2") || { echo "$3: other bits" >&2; return 1; }
}

# Waits until a command succeeds, or fails after so many seconds.
wait_until() {  # SECONDS WHAT COMMAND...
    local end=$((SECONDS + $1)) what=$2
    shift 2
    until "$@"; do
        ((SECONDS < end)) || { echo "waited in vain: $what" >&2; return 1; }
        sleep 0.05
    done
}

# The process that works on a shard of a folder, as numbered here: no zombie, and the whole program, no shell before it.
worker_of() {  # FOLDER SHARD
    local pid line
    for pid in $(pgrep -x lampyris); do
        mapfile -d '' -t line 2>/dev/null <"/proc/$pid/cmdline" || continue
        if [[ ${line[1]:-} == work && ${line[2]:-} == "$1" && ${line[4]:-} == "$2" ]]; then
            echo "$pid"
            return
        fi
    done
    return 1
}

# Holds the worker of a shard when it has written a checkpoint and is not done: whatever is to hit it will hit it at work.
held_at_work() {  # FOLDER SHARD
    local pid
    pid=$(worker_of "$1" "$2") || return 1
    [[ -e $1/shards/shard-00000$2.ckpt ]] && kill -STOP "$pid"
}
