#!/usr/bin/env bash
# Runs every check: format, lints, tests, documentation. `tests/run.sh` from a clean checkout is
# enough; on a fresh Debian it installs what building needs (as root) or says what is missing.
#
# Everything is built with --release, so that dependencies are compiled once.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$*"; }
fail() { printf 'tests/run.sh: %s\n' "$*" >&2; exit 1; }

step "Tools"
assets/setup.sh
missing=() packages=()
cargo fmt --version >/dev/null 2>&1 || { missing+=(rustfmt) && packages+=(rustfmt-web); }
cargo clippy --version >/dev/null 2>&1 || { missing+=(clippy) && packages+=(rust-web-clippy); }
if [ "${#missing[@]}" -gt 0 ]; then
    if command -v rustup >/dev/null; then
        rustup component add "${missing[@]}"
    elif [ "$(id -u)" = 0 ] && dpkg -s rustc-web >/dev/null 2>&1; then
        # Debian has them in packages beside its compiler.
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}"
    else
        fail "missing: ${missing[*]}. Add them with one of
  rustup component add ${missing[*]}
  sudo apt-get install ${packages[*]}      (where the compiler is Debian's rustc-web)"
    fi
fi
rustc --version
cargo --version

step "Format"
cargo fmt --check

# Every target is compiled for them, benches too.
step "Lints"
cargo clippy --release --locked --all-targets -- -D warnings

step "The library without the window"
cargo check --release --locked --lib --no-default-features
tree=$(cargo tree --locked -e normal --no-default-features --prefix none --format '{p}')
# The first word is the name; egui and wgpu also come as families (egui_extras, wgpu-core).
if window=$(grep -E '^(egui|eframe|epaint|wgpu|winit|rfd)([-_ ]|$)' <<<"$tree"); then
    fail "these crates of the window are needed without it, too:
$window"
fi
grep -q '^lobelia ' <<<"$tree" || fail "cargo tree does not name the program itself"

step "Tests"
# Checks that need something that is not here say so in this file.
LOBELIA_SKIPPED=$(mktemp)
export LOBELIA_SKIPPED
trap 'rm -f "$LOBELIA_SKIPPED"' EXIT
if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --release --locked
else
    cargo test --release --locked --lib --bins --tests
fi
cargo test --release --locked --doc

step "Documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --no-deps

if [ -s "$LOBELIA_SKIPPED" ]; then
    step "$(wc -l <"$LOBELIA_SKIPPED") checks were skipped"
    sort "$LOBELIA_SKIPPED"
fi
step "All checks passed"
