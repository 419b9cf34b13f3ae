#!/usr/bin/env bash
# The studio on Windows and macOS, as far as it can be seen from Linux: checks the whole studio for both,
# links it for Windows with mingw, and runs terminal commands under wine. Writes what it saw into
# tests/systems.txt. Not among the tests of tests/run.sh: it builds everything anew, with the standard
# library (about forty minutes on two cores, and 3 GB in out/systems).
#
#   tests/systems.sh [check|all]        (default: all; check does not link)
#
# Needs, on Debian 12: rustc-web cargo-web libstd-rust-web-dev rust-web-src binutils-mingw-w64-x86-64, and
# for linking and running gcc-mingw-w64-x86-64-win32 wine64 wine.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'tests/systems.sh: %s\n' "$*" >&2; exit 1; }
step() { printf '\n== %s\n' "$*"; }
what=${1:-all}
case $what in check | all) ;; *) fail "\"$what\" is neither check nor all" ;; esac
windows=x86_64-pc-windows-gnu
macos=aarch64-apple-darwin
# Debian's own compiler: it comes with the sources of the standard library, which rustup's has to fetch.
debian=${LOBELIA_RUST:-/usr/bin}
[ -x "$debian/rustc" ] && [ -x "$debian/cargo" ] &&
    [ -e "$("$debian/rustc" --print sysroot)/lib/rustlib/src/rust/library/std/Cargo.toml" ] ||
    fail "a compiler with the sources of the standard library is missing (apt-get install rustc-web cargo-web libstd-rust-web-dev rust-web-src)"
tools=(x86_64-w64-mingw32-dlltool)
[ "$what" = check ] || tools+=(x86_64-w64-mingw32-gcc wine)
for tool in "${tools[@]}"; do
    command -v "$tool" >/dev/null ||
        fail "$tool is missing (apt-get install gcc-mingw-w64-x86-64-win32 binutils-mingw-w64-x86-64 wine64 wine)"
done
export PATH="$debian:$PATH" RUSTC="$debian/rustc" RUSTC_BOOTSTRAP=1
export CARGO_TARGET_DIR=${LOBELIA_SYSTEMS:-out/systems}
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER=x86_64-w64-mingw32-gcc
options=(--release --locked -Zbuild-std)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
report=()
say() { printf '%s\n' "$*"; report+=("$*"); }

say "lobelia $(git describe --always --dirty), $(date -u +%Y-%m-%d), $(rustc --version)"
for target in "$windows" "$macos"; do
    step "Check of the whole studio for $target"
    cargo check "${options[@]}" --target "$target" 2> >(tee "$work/check.log" >&2) ||
        fail "the studio does not check for $target"
    say "$target: the whole studio checks, $(grep -c '^warning' "$work/check.log" || true) warnings"
done

if [ "$what" = all ]; then
    step "Linked with mingw"
    cargo build "${options[@]}" --target "$windows" --bin lobelia
    x86_64-w64-mingw32-strip -o "$work/lobelia.exe" "$CARGO_TARGET_DIR/$windows/release/lobelia.exe"
    say "$windows: linked, $(($(stat -c %s "$work/lobelia.exe") / 1000000)) MB stripped"
    # What Windows does not have itself would have to be shipped.
    foreign=$(x86_64-w64-mingw32-objdump -p "$work/lobelia.exe" | sed -n 's/.*DLL Name: //p' | grep -iE 'gcc|pthread|stdc' || true)
    [ -z "$foreign" ] || fail "the program needs libraries of mingw: $foreign"

    # Windows has had this library since version 8; the wine of Debian 12 has not. Rust's standard library takes
    # random numbers from it.
    cat >"$work/random.c" <<'C'
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(void *, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(BYTE *bytes, SIZE_T count) {
    return SystemFunction036(bytes, (ULONG)count);
}
C
    x86_64-w64-mingw32-gcc -shared -o "$work/bcryptprimitives.dll" "$work/random.c" -ladvapi32

    step "Under wine"
    export WINEPREFIX=$work/wine WINEDEBUG=-all
    unset DISPLAY WAYLAND_DISPLAY
    lobelia() { wine "$work/lobelia.exe" "$@" </dev/null; }
    lobelia --version >"$work/version.txt" 2>"$work/errors" || fail "the program does not start: $(cat "$work/errors")"
    say "$(wine --version): $(tr -d '\r' <"$work/version.txt")"
    lobelia --help >"$work/help.txt"
    grep -q reconstruct "$work/help.txt" || fail "--help does not list the commands"
    say "--help: $(wc -l <"$work/help.txt") lines"
    cp -r assets/examples/corner "$work/corner"
    lobelia info "$work/corner" >"$work/info.txt"
    grep -q 'photographs: 6' "$work/info.txt" || fail "info does not find the photographs: $(cat "$work/info.txt")"
    say "info: $(grep photographs: "$work/info.txt" | tr -d '\r')"
    lobelia reconstruct "$work/corner" --out "$work/out" --quality draft
    [ -s "$work/out/solution.json" ] || fail "no solution was written"
    say "reconstruct --quality draft, then score:"
    lobelia score "$work/corner" "$work/out" | tr -d '\r' >"$work/score.txt"
    while IFS= read -r line; do say "  $line"; done <"$work/score.txt"
    # A fault has the exit code of other systems, and no path begins with \\?\.
    code=0
    lobelia info "$work/nowhere" 2>"$work/fault.txt" || code=$?
    [ "$code" = 1 ] || fail "a missing capture gives exit code $code, not 1"
    ! grep -qF '\\?\' "$work/fault.txt" "$work/info.txt" "$work/out/solution.json" || fail 'a path begins with \\?\'
    say "a missing capture: exit code 1; no path begins with \\\\?\\"
fi
printf '%s\n' "${report[@]}" >tests/systems.txt
printf '\n== Written to tests/systems.txt\n'
