#!/bin/bash
# A disk that is really full, and one that is mounted read-only: a worker and a merge end with exit code 1, what stood there
# stays, and with room again the bits are those of a run that had it. Needs root.
#
#     disk.sh PROGRAM FOLDER
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "$1") folder=$2/disk
as_root=$([[ $(id -u) == 0 ]] || echo sudo)

mkdir -p "$folder/small"
$as_root mount -t tmpfs -o size=1m,mode=0777 tmpfs "$folder/small"
trap '$as_root umount "$folder/small"' EXIT

fails() { # WORDS COMMAND...: exit code 1, saying WORDS
    local code=0 said
    said=$("${@:2}" 2>&1) || code=$?
    [[ $code == 1 && $said == *"$1"* ]] || { echo "${*:2}: exit code $code: $said" >&2; exit 1; }
}
digest() { sed -n 's/.*"results_digest": "\(.*\)".*/\1/p' "$1/summary.json"; }

job=scripts/external/disk.toml
"$program" run -q $job -o "$folder/straight" >/dev/null
"$program" plan $job -o "$folder/small/dir" >/dev/null
"$program" work "$folder/small/dir" --shard 0 >/dev/null
sums=$(cd "$folder/small/dir" && sha256sum plan.toml shards/*.ckpt)
head -c 16m /dev/zero >"$folder/small/filler" 2>/dev/null || true
fails "No space left on device" "$program" work "$folder/small/dir" --shard 1
fails "No space left on device" "$program" merge "$folder/small/dir"
fails "No space left on device" "$program" compact "$folder/small/dir"
[[ $sums == "$(cd "$folder/small/dir" && sha256sum plan.toml shards/*.ckpt)" ]]
rm "$folder/small/filler"

$as_root mount -o remount,ro "$folder/small"
fails "Read-only file system" "$program" work "$folder/small/dir" --shard 1
fails "Read-only file system" "$program" merge "$folder/small/dir"
"$program" status "$folder/small/dir" >/dev/null
"$program" merge "$folder/small/dir" -o "$folder/out" >/dev/null && exit 1 || [[ $? == 3 ]]
$as_root mount -o remount,rw "$folder/small"
$as_root mount -o remount,size=64m "$folder/small"
"$program" run -q $job -o "$folder/small/dir" >/dev/null
[[ $(digest "$folder/small/dir") == "$(digest "$folder/straight")" ]]
echo "a full and a read-only disk: refused, nothing lost, the same bits afterwards"
