#!/usr/bin/env bash
# Makes sure that lobelia can be built: installs what a fresh Debian 12 lacks (as root), or says
# what is missing. Does nothing where all is there.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'assets/setup.sh: %s\n' "$*" >&2; exit 1; }

# The linker comes with the C compiler; the picture metric FLIP is in C++.
if ! command -v cc >/dev/null || ! command -v c++ >/dev/null; then
    missing=(build-essential)
    command -v pkg-config >/dev/null || missing+=(pkg-config)
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${missing[@]}"
    else
        fail "there is no C and C++ compiler, which the program is linked and in part built with. Install these packages and run this again:
  sudo apt-get install ${missing[*]}"
    fi
fi
if ! command -v cargo >/dev/null; then
    # Where rustup puts it; a shell that was open before does not know.
    [ ! -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ] ||
        fail "Rust is installed, but not found by this shell. Run this and try again:
  . \"${CARGO_HOME:-$HOME/.cargo}/env\""
    fail "there is no Rust. Install $(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml) or later from https://rustup.rs"
fi
