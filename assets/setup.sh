#!/usr/bin/env bash
# Makes sure that lobelia can be built and its window opened: installs what a fresh Debian 12
# lacks (as root), or says what is missing. Does nothing where all is there.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'assets/setup.sh: %s\n' "$*" >&2; exit 1; }

# The linker comes with the C compiler; pkg-config is asked for X11 by one of the window's crates.
build=()
command -v cc >/dev/null || build+=(build-essential)
command -v pkg-config >/dev/null || build+=(pkg-config)

# The window loads these when it opens: a Vulkan driver (on the processor where there is no
# graphics card), X11 or Wayland, the keyboard, system dialogs.
window=()
# ldconfig is not on every user's path.
libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true)
need() { grep -q "$1" <<<"$libraries" || window+=("$2"); }
need libvulkan.so.1 libvulkan1
need libX11.so.6 libx11-6
need libX11-xcb.so.1 libx11-xcb1
need libXcursor.so.1 libxcursor1
need libXi.so.6 libxi6
need libXrender.so.1 libxrender1
need libxkbcommon.so.0 libxkbcommon0
need libxkbcommon-x11.so.0 libxkbcommon-x11-0
need libxcb.so.1 libxcb1
need libwayland-client.so.0 libwayland-client0
need libEGL.so.1 libegl1
need libdbus-1.so.3 libdbus-1-3
need libfontconfig.so.1 libfontconfig1
compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null ||
    compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null ||
    window+=(mesa-vulkan-drivers libgl1-mesa-dri)

missing=("${build[@]}" "${window[@]}")
if [ "${#missing[@]}" -gt 0 ]; then
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${missing[@]}"
    elif [ "${#build[@]}" -gt 0 ]; then
        fail "what links the program is missing. Install these packages and run this again:
  sudo apt-get install ${missing[*]}"
    else
        printf '%s\n' "assets/setup.sh: the window and its tests need these packages of Debian;" \
            "the terminal commands work without them:" \
            "  sudo apt-get install ${window[*]}" >&2
    fi
fi
if ! command -v cargo >/dev/null; then
    # Where rustup puts it; a shell that was open before does not know.
    [ ! -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ] ||
        fail "Rust is installed, but not found by this shell. Run this and try again:
  . \"${CARGO_HOME:-$HOME/.cargo}/env\""
    fail "there is no Rust. Install $(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml) or later from https://rustup.rs"
fi
