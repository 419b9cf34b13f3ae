#!/usr/bin/env bash
# Makes the guide's charts of the studies anew, with the tables that their numbers are from: five
# minutes on a quiet machine of two cores. With LOBELIA_CAPTURES also that of corner-diffuse, with
# the peer, in eight more.
set -euo pipefail
cd "$(dirname "$0")/../.."

lobelia() { cargo run --release --locked --no-default-features -- "$@"; }
out=${1:-out}

rm -rf "$out/speed" "$out/stability" "$out/speed-corner-diffuse"
lobelia study speed assets/examples/corner --quick --out "$out/speed"
cp "$out/speed/corner.svg" assets/guide/pictures/speed.svg
cp "$out/speed/speed.csv" "$out/speed/front.csv" assets/study/
lobelia study stability assets/examples/corner --quick --out "$out/stability"
cp "$out/stability/stability.svg" assets/guide/pictures/
cp "$out/stability/stability.csv" "$out/stability/breaks.csv" assets/study/
if [ -n "${LOBELIA_CAPTURES:-}" ]; then
    lobelia study speed "$LOBELIA_CAPTURES/corner-diffuse" --repeats 1 --out "$out/speed-corner-diffuse"
    cp "$out/speed-corner-diffuse/corner-diffuse.svg" assets/guide/pictures/corner-diffuse.svg
    cp "$out/speed-corner-diffuse/speed.csv" assets/study/speed-corner-diffuse.csv
fi
