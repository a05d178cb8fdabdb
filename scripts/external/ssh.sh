#!/bin/bash
# Two hosts without a scheduler: sshd twice on the loopback, one host with a copy of the folder, one that shares it and is
# killed, workers and all, while it is at work: the bits of a run on one machine.
# Then two shards in a shared folder that shows one of them some seconds late: nothing is computed twice.
#
#   ssh.sh PROGRAM FOLDER      writes below FOLDER; needs sshd, GNU parallel, rsync, oiiotool; root, to log in without a password
set -euo pipefail

program=$(realpath "$1")
folder=$2
here=$(realpath "$(dirname "$0")")
# shellcheck source=bits.sh
source "$here/bits.sh"
farm="$folder/by ssh"
copy="$folder/a copy elsewhere"
mkdir -p "$folder/sshd"
begun=$SECONDS

say() { echo "ssh, $((SECONDS - begun)) s: $*"; }
# A process and all below it.
family() {
    local child
    echo "$1"
    for child in $(cat "/proc/$1"/task/*/children 2>/dev/null); do family "$child"; done
}
hosts=()
after() {
    (($? == 0)) || tail -n 20 "$farm/ssh/log" >&2 || true
    for pid in "${hosts[@]}"; do
        # shellcheck disable=SC2046
        [[ ! -e /proc/$pid ]] || kill -KILL $(family "$pid") 2>/dev/null || true
    done
}
trap after EXIT

[[ -e "$folder/one machine/summary.json" ]] || "$program" run -q "$here/farm.toml" -o "$folder/one machine" >/dev/null

for key in mine of_hosts; do ssh-keygen -q -t ed25519 -N '' -f "$folder/sshd/$key"; done
mkdir -p /run/sshd
host() {  # PORT
    printf '%s\n' "Port $1" 'ListenAddress 127.0.0.1' "HostKey $folder/sshd/of_hosts" "PidFile none" \
        "AuthorizedKeysFile $folder/sshd/mine.pub" 'StrictModes no' 'PasswordAuthentication no' 'PermitRootLogin yes' \
        'UsePAM no' 'MaxStartups 100' >"$folder/sshd/config-$1"
    "$(PATH=$PATH:/usr/sbin type -P sshd)" -D -f "$folder/sshd/config-$1" -E "$folder/sshd/log-$1" &
    hosts+=($!)
    disown
    wait_until 5 "sshd" eval "(exec 3<>/dev/tcp/127.0.0.1/$1) 2>/dev/null"
}
first=$((30000 + $$ % 20000))
host "$first"
host $((first + 1))
options="-i $folder/sshd/mine -o IdentitiesOnly=yes -o GSSAPIAuthentication=no -o StrictHostKeyChecking=no -o UserKnownHostsFile='$folder/sshd/known hosts'"
cat >"$folder/hosts" <<HOSTS
# processes  login  folder
2 "$options $(id -un)@127.0.0.1:$first"  "$copy"
2 "$options $(id -un)@127.0.0.1:$((first + 1))"
1 "$options nobody-there@127.0.0.1:1"
HOSTS

"$program" submit "$here/farm.toml" -o "$farm" --engine ssh --hosts "$folder/hosts" >"$folder/said" 2>&1 &
submitted=$!

# Whichever shards the second host has begun; they are held until it is dead.
one_held() {
    for shard in {0..7}; do
        if held_at_work "$farm" "$shard"; then return; fi
    done
    return 1
}
wait_until 60 "a worker on the second host" one_held
say "the second host is at work on shard $shard"
# shellcheck disable=SC2046
kill -KILL $(family "${hosts[1]}")
say "the second host is dead"
wait "$submitted" || { cat "$folder/said" >&2; exit 1; }
cat "$folder/said"
grep -q 'is left out' "$folder/said"
[[ -e $copy/shards/shard-00000$shard.ckpt ]] || { echo "shard $shard was not given to the other host" >&2; exit 1; }
(($(wc -l <"$farm/attempts/shard-00000$shard.jsonl") >= 2))
same_bits "$folder/one machine" "$farm" "two hosts and one machine"
# The folders, merged by hand: what stands in the copy counts once.
"$program" merge "$farm" "$copy" -o "$folder/merged" >/dev/null
same_bits "$folder/one machine" "$folder/merged" "a copy merged in and one machine"
say "two hosts and one machine give the same bits"

# As a network file system may: the file of shard 0 is away when the last worker ends, and comes back later.
late="$folder/shown late"
sed "s/^batches = 128/batches = 32/; s|^scene = \"|&$here/|" "$here/farm.toml" >"$folder/two.toml"
"$program" run -q "$folder/two.toml" -o "$folder/two on one machine" >/dev/null
echo '2 :' >"$folder/this machine"
"$program" submit "$folder/two.toml" -o "$late" --engine ssh --hosts "$folder/this machine" >"$folder/said" 2>&1 &
submitted=$!
batches_of() {
    "$program" status --json "$late" | python3 -c 'import json, sys
print(sum(s["batches"] for s in json.load(sys.stdin)["shards"] if s["shard"] == int(sys.argv[1])))' "$1"
}
is_whole() { (($(batches_of "$1") == 16)); }
wait_until 60 "shard 1 is at work" held_at_work "$late" 1
wait_until 60 "shard 0 is done" is_whole 0
mv "$late/shards/shard-000000.ckpt" "$folder/not shown yet"
kill -CONT "$(worker_of "$late" 1)"
wait_until 60 "shard 1 is done" is_whole 1
sleep 3
mv "$folder/not shown yet" "$late/shards/shard-000000.ckpt"
wait "$submitted" || { cat "$folder/said" >&2; exit 1; }
same_bits "$folder/two on one machine" "$late" "a shard that is shown late and one machine"
(($(wc -l <"$late/attempts/shard-000000.jsonl") == 1)) || { echo "shard 0 was computed twice" >&2; exit 1; }
say "a shard that was shown late was waited for"
