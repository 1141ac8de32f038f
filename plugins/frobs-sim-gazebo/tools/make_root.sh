#!/bin/sh
# Make a Debian 11 system with Gazebo 11 in a folder, for machines whose own system has no Gazebo.
#
#   make_root.sh [FOLDER]      default: $FROBS_GAZEBO_ROOT, else ~/.cache/frobs/gazebo-root
#
# The mirror is the one that this machine's own apt uses, read when the script runs. Packages are checked against
# Debian's archive keys, as always. A root that is complete is left as it is; a half-made one is made anew.
# It needs root's rights, debootstrap and debian-archive-keyring, about 2.5 GB of disk, and some minutes.
set -eu

SUITE=bullseye
PACKAGES="gazebo gazebo-plugin-base libgazebo-dev g++ cmake make"
KEYRING=/usr/share/keyrings/debian-archive-keyring.gpg
root=${1:-${FROBS_GAZEBO_ROOT:-${XDG_CACHE_HOME:-$HOME/.cache}/frobs/gazebo-root}}
case $root in /*) ;; *) root=$PWD/$root ;; esac
mark=etc/frobs-gazebo-root
recipe="1 $SUITE $PACKAGES"

fail() {
    echo "make_root: $*" >&2
    exit 1
}

is_complete() {
    [ -f "$1/$mark" ] && [ "$(cat "$1/$mark")" = "$recipe" ] && [ -x "$1/usr/bin/gzserver" ]
}

# The addresses of Debian's archives in this machine's sources: of one-line and of deb822 files.
archives() {
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
        [ -f "$file" ] && sed -n 's/^deb \(\[[^]]*\] \)\{0,1\}\([^ ]*\) .*/\2/p' "$file"
    done
    for file in /etc/apt/sources.list.d/*.sources; do
        [ -f "$file" ] && sed -n 's/^URIs: *//p' "$file" | tr ' ' '\n'
    done
    return 0
}

is_complete "$root" && { echo "make_root: $root is complete"; exit 0; }
[ "$(id -u)" = 0 ] || fail "needs root's rights: sudo $0 $root"
command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap debian-archive-keyring"
[ -f "$KEYRING" ] || fail "the archive's keys are missing: apt-get install debian-archive-keyring"
command -v flock >/dev/null || fail "flock is missing: apt-get install util-linux"
case $root in /|/usr|/usr/*|/etc|/etc/*|/home|/root|/var|/opt|/tmp) fail "$root is no place for a root" ;; esac

mkdir -p "$(dirname "$root")"
exec 9>"$root.lock"
flock -n 9 || { echo "make_root: another one is at work; waiting for it"; flock 9; }
is_complete "$root" && { echo "make_root: $root is complete"; exit 0; }
if [ -e "$root" ] && [ ! -f "$root/$mark" ] && [ ! -d "$root/debootstrap" ] && [ -n "$(ls -A "$root")" ]; then
    fail "$root holds something else; name another folder"
fi

mirror=${FROBS_DEBIAN_MIRROR:-$(archives | grep -E '/debian/?$' | head -n 1)}
[ -n "$mirror" ] || fail "no Debian archive is named in /etc/apt; FROBS_DEBIAN_MIRROR=ADDRESS names one"
security=$(archives | grep -E '/debian-security/?$' | head -n 1)

partial=$root.partial
trap 'status=$?; [ $status = 0 ] || echo "make_root: failed; $partial is made anew next time" >&2' EXIT
trap 'exit 130' INT TERM HUP
rm -rf --one-file-system "$partial"
start=$(date +%s)
debootstrap --variant=minbase --keyring="$KEYRING" "$SUITE" "$partial" "$mirror"

printf 'deb %s %s main\n' "$mirror" "$SUITE" >"$partial/etc/apt/sources.list"
[ -z "$security" ] || printf 'deb %s %s-security main\n' "$security" "$SUITE" >>"$partial/etc/apt/sources.list"
printf '127.0.0.1 localhost\n::1 localhost\n' >"$partial/etc/hosts"
[ -f /etc/resolv.conf ] && cat /etc/resolv.conf >"$partial/etc/resolv.conf"
apt-config dump Acquire | grep -E '::(Proxy|CAInfo|Retries|Check-Valid-Until|Check-Date)' \
    >"$partial/etc/apt/apt.conf.d/90machine" || true
# Nothing of it is for reading, or is to be started; and a root that a power cut spoils is made anew anyway.
cat >"$partial/etc/dpkg/dpkg.cfg.d/90frobs" <<'END'
force-unsafe-io
path-exclude=/usr/share/doc/*
path-exclude=/usr/share/man/*
path-exclude=/usr/share/info/*
path-exclude=/usr/share/locale/*
END
printf '#!/bin/sh\nexit 101\n' >"$partial/usr/sbin/policy-rc.d"
chmod +x "$partial/usr/sbin/policy-rc.d"

inside() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C DEBIAN_FRONTEND=noninteractive \
        ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} chroot "$partial" "$@"
}
install() {
    # shellcheck disable=SC2086  # words, on purpose
    inside apt-get -q update && inside apt-get -q -y -o Acquire::Retries=3 --no-install-recommends install $PACKAGES
}
# Some mirrors list updates of this old release that they no longer hold.
install || {
    echo "make_root: once more, without the security archive"
    sed -i '/-security /d' "$partial/etc/apt/sources.list"
    install
}
inside apt-get clean
rm -rf "$partial"/var/lib/apt/lists/*
inside gzserver --version | head -n 1

printf '%s\n' "$recipe" >"$partial/$mark"
rm -rf --one-file-system "$root"
mv "$partial" "$root"
echo "make_root: $root made in $(($(date +%s) - start)) s"
