#!/usr/bin/env bash
# Installs the Debian package in a clean Debian 12, uses it, removes it, and looks for what is left. Also
# unpacks the archive there. As root; not among the tests of tests/run.sh, since it fetches Debian.
#
#   tests/package.sh [FOLDER]           (default: out/package, where assets/package.sh writes)
#
# Needs debootstrap. With the packages' network at hand; about 400 MB in a temporary folder.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'tests/package.sh: %s\n' "$*" >&2; exit 1; }
step() { printf '\n== %s\n' "$*"; }
[ "$(id -u)" = 0 ] || fail "debootstrap and chroot need root"
command -v debootstrap >/dev/null || fail "debootstrap is missing (apt-get install debootstrap)"
folder=${1:-out/package}
deb=$(ls "$folder"/lobelia_*.deb) || fail "there is no package in $folder: run assets/package.sh first"
archive=$(ls "$folder"/lobelia-*.tar.gz)
root=${LOBELIA_ROOT:-$(mktemp -d)/debian}
mkdir -p "$root"
cleanup() {
    umount "$root/proc" 2>/dev/null || true
    [ -n "${LOBELIA_ROOT:-}" ] || rm -rf "${root%/debian}"
}
trap cleanup EXIT
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

step "A clean Debian 12"
[ -x "$root/bin/bash" ] || debootstrap --variant=minbase bookworm "$root" >/dev/null
cp /etc/resolv.conf "$root/etc/resolv.conf"
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc" 2>/dev/null || echo "(without /proc)"
# The screen and a hand, so that what the package brings is the only thing that is removed.
inside apt-get update -qq
inside apt-get install -y -qq --no-install-recommends xvfb xdotool imagemagick man-db >/dev/null

step "The terminal alone, without what is recommended"
cp "$deb" "$root/tmp/lobelia.deb"
inside apt-get install -y -qq --no-install-recommends /tmp/lobelia.deb >/dev/null
inside lobelia --version
inside lobelia --help >/dev/null
inside bash -c 'cd /root && lobelia reconstruct /usr/share/lobelia/examples/corner --out /root/out --quality draft'
[ -s "$root/root/out/solution.json" ] || fail "no solution was written"
inside bash -c 'lobelia score /usr/share/lobelia/examples/corner /root/out'
inside bash -c 'zcat /usr/share/man/man1/lobelia-reconstruct.1.gz | grep -q "transport.rays"' || fail "the man page is empty"
step "Without a screen"
if inside lobelia 2>"$root/tmp/window.err"; then fail "a window opened without a screen"; fi
cat "$root/tmp/window.err"
grep -q "apt-get install" "$root/tmp/window.err" || fail "the message does not say what to install"
grep -q panicked "$root/tmp/window.err" && fail "the program panicked"

step "The window, with what is recommended"
inside apt-get install -y -qq $(dpkg-deb -f "$deb" Recommends | tr ',' '\n' | sed 's/|.*//' | tr -d ' ' | tr '\n' ' ') >/dev/null
inside bash -c '
    Xvfb :93 -screen 0 1280x720x24 >/dev/null 2>&1 & server=$!
    sleep 2
    export DISPLAY=:93
    lobelia /usr/share/lobelia/examples/corner >/tmp/window.log 2>&1 & window=$!
    for _ in $(seq 120); do xdotool search --name "corner - Lobelia" >/dev/null 2>&1 && break; sleep 1; done
    sleep 5
    import -window root /tmp/window.png
    xdotool search --name "corner - Lobelia" windowfocus key ctrl+q
    for _ in $(seq 20); do kill -0 $window 2>/dev/null || break; sleep 0.5; done
    ! kill -0 $window 2>/dev/null; ended=$?
    kill $window $server 2>/dev/null
    exit $ended' || fail "the window did not open or not close: $(cat "$root/tmp/window.log")"
colours=$(inside identify -format %k /tmp/window.png)
[ "$colours" -gt 200 ] || fail "the window is empty: $colours colours"
cp "$root/tmp/window.png" "$folder/window.png"

step "The archive, elsewhere"
mkdir -p "$root/tmp/elsewhere"
tar -C "$root/tmp/elsewhere" -xzf "$archive"
inside bash -c '/tmp/elsewhere/lobelia-*/bin/lobelia info /tmp/elsewhere/lobelia-*/share/lobelia/examples/corner' | head -3

step "Removed"
inside dpkg --purge lobelia >/dev/null
inside apt-get autoremove -y -qq --purge >/dev/null || true
inside bash -c 'find / -xdev -name "*lobelia*" -not -path "/proc/*" -not -path "/tmp/*" -not -path "/root/*" -not -path "/var/cache/*" -not -path "/var/log/*"' >"$root/tmp/left"
[ ! -s "$root/tmp/left" ] || fail "this is left: $(cat "$root/tmp/left")"
printf '\n== The package works, and leaves nothing behind\n'
