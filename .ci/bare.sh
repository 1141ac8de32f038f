#!/usr/bin/env bash
# Run the two commands of the README on a bare machine: a Debian 12 with git, make, Python 3.11 and pip, and nothing else.
#
#   .ci/bare.sh                        make demo, then make test; in a fresh clone, because the machine makes .venv itself
#   .ci/bare.sh make test PYTEST_ARGS=tests/docs        another command
#   FROBS_BARE_DEBIAN=trixie .ci/bare.sh                the same with Debian 13 and Python 3.13
#
# The bare machine is a folder (default: ~/.cache/frobs/bare-bookworm, or $FROBS_BARE_ROOT) that debootstrap fills once. A
# command sees that folder as /, this checkout at its own path, the network, and the package index that pip is configured
# to use; it sees neither the programs nor the display of this machine. Afterwards .venv works on this machine, too, if
# this machine has the same Debian. Needs root's rights, debootstrap and debian-archive-keyring; 400 MB and a minute.
set -euo pipefail
cd "$(dirname "$0")/.."
repository=$PWD
debian=${FROBS_BARE_DEBIAN:-bookworm}
root=${FROBS_BARE_ROOT:-${XDG_CACHE_HOME:-$HOME/.cache}/frobs/bare-$debian}
packages=ca-certificates,git,make,python3,python3-pip,python3-venv
recipe="1 $debian $packages"

fail() {
  echo "bare.sh: $*" >&2
  exit 2
}

[[ $(id -u) == 0 ]] || fail "needs root's rights: sudo $0"
for program in debootstrap unshare flock; do
  command -v "$program" >/dev/null || fail "$program is missing: apt-get install debootstrap debian-archive-keyring util-linux"
done

make_root() {
  local mirror partial=$root.partial
  mirror=${FROBS_DEBIAN_MIRROR:-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    grep -oE '(https?|file)://[^ ]+/debian/?( |$)' | head -n 1 || true)}
  [[ -n $mirror ]] || fail "no Debian archive is named in /etc/apt; FROBS_DEBIAN_MIRROR=ADDRESS names one"
  echo "Making a bare machine in $root."
  rm -rf --one-file-system "$partial" "$root"
  mkdir -p "$(dirname "$root")"
  debootstrap --variant=minbase --include="$packages" --keyring=/usr/share/keyrings/debian-archive-keyring.gpg \
    "$debian" "$partial" "$mirror" >"$root.log" 2>&1 || fail "debootstrap failed: $(tail -n 3 "$root.log")"
  rm -rf "$partial"/var/cache/apt/archives/*.deb "$partial"/var/lib/apt/lists/*
  echo "$recipe" >"$partial/etc/frobs-bare-root"
  mv "$partial" "$root"
}

mkdir -p "$(dirname "$root")"
exec 9>"$root.lock"
flock 9
[[ -f $root/etc/frobs-bare-root && $(<"$root/etc/frobs-bare-root") == "$recipe" ]] || make_root
flock -u 9

python=$(sed -n 's/^executable = //p' .venv/pyvenv.cfg 2>/dev/null || true)
[[ -z $python || -x $root$python ]] ||
  fail ".venv was made with $python, which a bare machine does not have; run this in a fresh clone"

# The folders of a package index on this machine, the certificates, and pip's cache of downloads.
folders=$({
  python3 -m pip config list 2>/dev/null || true
  env | grep -E '^(PIP_|[A-Z_]*CERT)' || true
} | tr "= '" '\n' | sed 's,^file://,,' | grep -E '^/(opt|srv|mnt|var|etc/ssl)/' | sort -u)
# /opt/pypi/simple is an index whose files lie beside it
folders=$(for each in $folders; do [[ $each == */simple ]] && dirname "$each" || echo "$each"; done)
variables=(HOME=/root PATH=/usr/local/bin:/usr/bin:/bin LANG=C.UTF-8 TERM="${TERM:-dumb}")
while IFS= read -r variable; do variables+=("$variable"); done < <(
  env | grep -E '^(PIP_[A-Z_]*|[A-Z_]*CERT[A-Z_]*|[A-Z_]*CA_BUNDLE|https?_proxy|no_proxy|CI|FROBS_SAMPLE)=' || true
)
export repository root folders

# shellcheck disable=SC2016  # expanded by the inner shell
unshare --mount --pid --fork --kill-child --propagation private bash -euc '
  mount --bind "$root" "$root"
  mount -t proc proc "$root/proc"
  mount --rbind -o ro /sys "$root/sys"
  mount -t tmpfs -o mode=755 tmpfs "$root/dev"
  for device in null zero full random urandom tty; do
    touch "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
  done
  mkdir "$root/dev/shm" "$root/dev/pts"
  mount -t tmpfs tmpfs "$root/dev/shm"
  mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
  ln -s pts/ptmx "$root/dev/ptmx"
  ln -s /proc/self/fd "$root/dev/fd"
  mount -t tmpfs tmpfs "$root/tmp"
  share() { # at the same path
    [[ -e $1 ]] || return 0
    if [[ -d $1 ]]; then mkdir -p "$root$1"; else mkdir -p "$(dirname "$root$1")"; touch "$root$1"; fi
    mount --bind "$1" "$root$1"
  }
  for folder in $folders /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/xdg/pip /etc/ssl/certs; do share "$folder"; done
  for folder in .cache/pip .config/pip .pip; do # of this user, at home there
    [[ -d $HOME/$folder ]] || continue
    mkdir -p "$root/root/$folder"
    mount --bind "$HOME/$folder" "$root/root/$folder"
  done
  share "$repository"
  exec chroot "$root" /usr/bin/env --chdir="$repository" -i "$@"
' bare "${variables[@]}" bash -euc 'git config --global --add safe.directory "*"; eval "$1"' bare \
  "$(if (($#)); then printf '%q ' "$@"; else echo 'make demo && make test'; fi)"
