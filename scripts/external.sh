#!/bin/bash
# Tests that need programs beside the Rust toolchain: the EXR maps in OpenEXR's and OpenImageIO's own tools, and the same bits on
# an old processor in qemu and with another C library; disks that are full or read-only (needs root); the same bits from a real Slurm and from hosts by ssh,
# whose machines die at work.
# Installs what is missing (Debian); a tool that cannot be had is a failure.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(openexr openimageio-tools qemu-user patchelf munge slurmctld slurmd slurm-client openssh-server openssh-client parallel rsync procps)
tools=(exrheader exrinfo oiiotool iinfo qemu-x86_64 patchelf munged slurmctld slurmd sbatch sshd ssh parallel rsync pgrep)
PATH=$PATH:/usr/sbin

missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
if ((${#missing[@]})); then
    as_root=$([[ $(id -u) == 0 ]] || echo sudo)
    $as_root apt-get update -q
    # None of their daemons is to start by itself.
    policy=/usr/sbin/policy-rc.d
    made=
    if [[ ! -e $policy ]]; then
        printf '#!/bin/sh\nexit 101\n' | $as_root install -m 755 /dev/stdin $policy
        made=$policy
    fi
    failed=0
    DEBIAN_FRONTEND=noninteractive $as_root apt-get install -q -y --no-install-recommends "${missing[@]}" || failed=$?
    [[ -z $made ]] || $as_root rm "$made"
    ((failed == 0)) || exit "$failed"
fi
for tool in "${tools[@]}"; do
    command -v "$tool" >/dev/null || { echo "$tool is not here although ${packages[*]} are installed" >&2; exit 1; }
done

cargo build --release --locked
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
target/release/lampyris run -q scripts/external/room.toml -o "$folder/room"
scripts/external/check_exr.py "$folder/room"
scripts/external/paths.sh target/release/lampyris "$folder"
scripts/external/libc.sh target/release/lampyris "$folder"
scripts/external/disk.sh target/release/lampyris "$folder"
scripts/external/slurm.sh target/release/lampyris "$folder"
scripts/external/ssh.sh target/release/lampyris "$folder"
