# shellcheck shell=bash
# Root folders with a fresh Debian, for scripts that try Delassus there: sourced, not run.
fail() { echo "$(basename "$0"): $*" >&2; exit 2; }

# own_mounts "$@": starts the script once more where mounts are seen by its process alone, and end with it.
own_mounts() {
    [ "$(id -u)" -eq 0 ] || fail "chroot needs root"
    command -v debootstrap >/dev/null || fail "debootstrap was not found"
    [ -n "${DELASSUS_OWN_MOUNTS:-}" ] || DELASSUS_OWN_MOUNTS=1 exec unshare --mount --propagation private "$0" "$@"
}

# mount_system ROOT: what a running system has, and this network: its names, and the certificates that it is trusted by.
mount_system() {
    local folder
    cp /etc/resolv.conf /etc/hosts "$1/etc/"
    if [ -f /etc/ssl/certs/ca-certificates.crt ]; then cp /etc/ssl/certs/ca-certificates.crt "$1/etc/network-certificates.crt"; fi
    mountpoint -q "$1/proc" || mount -t proc proc "$1/proc"
    for folder in dev sys; do mountpoint -q "$1/$folder" || mount --rbind "/$folder" "$1/$folder"; done
}

# debian_root RELEASE ROOT [PACKAGES]: a minimal system with these packages, which commas separate; one that is there is kept.
debian_root() {
    local release=$1 root=$2 found
    [ -e "$root/etc/debian_version" ] ||
        debootstrap --variant=minbase ${3:+--include="$3"} "$release" "$root" http://deb.debian.org/debian
    found=$(sed -n 's/^VERSION_CODENAME=//p' "$root/etc/os-release")
    [ "$found" = "$release" ] || fail "$root has ${found:-another system}, not $release"
    mount_system "$root"
}

# in_root ROOT COMMAND…: with the environment of a fresh system.
in_root() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
        NODE_EXTRA_CA_CERTS=/etc/network-certificates.crt chroot "$@"
}
