#!/bin/bash
# A host with another C library: the program with the library of the next Debian release does one of the two shards of paths.toml,
# and then both; the bits are those of this machine's library.
#
#   libc.sh PROGRAM FOLDER      writes below FOLDER; needs Debian's apt and its keys, patchelf and oiiotool
set -euo pipefail

program=$(realpath "$1")
folder=$2/libc
here=$(realpath "$(dirname "$0")")
job=$here/paths.toml
# shellcheck source=bits.sh
source "$here/bits.sh"
mkdir -p "$folder"/{lists/partial,cache/archives/partial,packages}

# The library of another release, unpacked in a folder of its own: nothing of it is installed.
# shellcheck source=/dev/null
release=$(source /etc/os-release && echo "${VERSION_CODENAME:-none}")
case $release in
    bookworm) other=trixie ;;
    trixie) other=forky ;;
    *) echo "which Debian release has a newer C library than $release?" >&2; exit 1 ;;
esac
from=$(apt-get indextargets --format '$(REPO_URI)' 'Origin: Debian' 'Created-By: Packages' "Codename: $release" | sort -u | head -n 1)
[[ -n $from ]] || { echo "apt knows no archive of $release" >&2; exit 1; }
echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $from $other main" >"$folder/sources.list"
apart=(-q -o Dir::Etc::sourcelist="$folder/sources.list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$folder/lists"
    -o Dir::Cache="$folder/cache" -o Dir::State::status=/dev/null -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none)
apt-get "${apart[@]}" update >/dev/null
(cd "$folder/packages" && apt-get "${apart[@]}" download libc6 libgcc-s1 >/dev/null)
for package in "$folder"/packages/*.deb; do dpkg-deb -x "$package" "$folder/other"; done
libraries=$folder/other/usr/lib/x86_64-linux-gnu
loader=$libraries/ld-linux-x86-64.so.2

# The program, which asks the other loader for the other library.
patchelf --set-interpreter "$loader" --set-rpath "$libraries" --output "$folder/lampyris" "$program"
"$loader" --list "$folder/lampyris" | grep -q "libm.so.6 => $libraries" ||
    { echo "the program does not load the other library" >&2; exit 1; }
version() { "$1" --version | grep -o 'version [0-9.]*[0-9]'; }
ours=$(version /lib64/ld-linux-x86-64.so.2)
theirs=$(version "$loader")
[[ $ours != "$theirs" ]] || { echo "both C libraries are of $ours" >&2; exit 1; }

# The program of each shard, one after the other.
render() {  # FOLDER PROGRAM PROGRAM
    "$2" plan "$job" -o "$1" >/dev/null
    "$2" work "$1" --shard 0 >/dev/null
    "$3" work "$1" --shard 1 >/dev/null
    "$3" merge "$1" >/dev/null
}

render "$folder/ours" "$program" "$program"
render "$folder/mixed" "$program" "$folder/lampyris"
render "$folder/theirs" "$folder/lampyris" "$folder/lampyris"
same_bits "$folder/ours" "$folder/mixed" "hosts with two C libraries"
same_bits "$folder/ours" "$folder/theirs" "another C library"
echo "C library $ours and $theirs: the same bits, shard by shard too"
