#!/bin/bash
# The same bits with all instructions: renders paths.toml with every path that this processor has and, in qemu, on a processor of
# 2008 that has none of them, and compares digests, tables and decoded maps.
#
#   paths.sh PROGRAM FOLDER      writes below FOLDER; needs qemu-x86_64 and oiiotool
set -euo pipefail

program=$1
folder=$2
job=$(dirname "$0")/paths.toml
old=(qemu-x86_64 -cpu Nehalem "$program")

# One process after the other, without a coordinator: its workers would not run in qemu.
render() {
    local to=$1
    shift
    "$@" plan "$job" -o "$to" >/dev/null
    for shard in 0 1; do
        "$@" work "$to" --shard "$shard" >/dev/null
    done
    "$@" merge "$to" >/dev/null
}

# Fails unless the summary in a folder says that the kernels ran with these instructions.
ran_with() {
    python3 -c 'import json, sys; print(*json.load(open(sys.argv[1]))["instructions"])' "$1/summary.json" | grep -qx "$2" ||
        { echo "$1/summary.json does not say $2" >&2; exit 1; }
}

# All that must be the same, a line each.
bits() {
    python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["results_digest"])' "$1/summary.json"
    oiiotool --hash "$1/wide.exr" | grep SHA-1
    sha256sum <"$1/table_height.csv"
}

if LAMPYRIS_SIMD=avx2 "${old[@]}" plan "$job" -o "$folder/refused" 2>"$folder/said"; then
    echo "the processor of 2008 has AVX2" >&2
    exit 1
fi
grep -q 'what this processor has: scalar$' "$folder/said"

render "$folder/old" "${old[@]}"
ran_with "$folder/old" scalar
bits "$folder/old" >"$folder/expected"
for path in avx512 avx2 scalar; do
    if ! LAMPYRIS_SIMD=$path "$program" plan "$job" -o "$folder/$path" >/dev/null 2>"$folder/said"; then
        grep -q 'what this processor has' "$folder/said" || { cat "$folder/said" >&2; exit 1; }
        echo "this processor has no $path: not compared"
        continue
    fi
    LAMPYRIS_SIMD=$path render "$folder/$path" "$program"
    ran_with "$folder/$path" "$path"
    bits "$folder/$path" | diff "$folder/expected" - || { echo "$path and a processor of 2008 differ" >&2; exit 1; }
    echo "$path: the bits of a processor of 2008"
done
