#!/usr/bin/env bash
# The exports of the example in the programs they are for: Khronos' validator of glTF, Mitsuba 3 and Blender.
# Writes what they said into tests/peers/results.txt. Not among the tests of tests/run.sh, which need no
# other program; about five minutes. A peer that is not there is counted as skipped, and then nothing is written.
#
#   tests/peers/run.sh [CAPTURE]        (default: assets/examples/corner)
#
# NODE_PATH       a node_modules folder with gltf-validator      (npm install gltf-validator)
# MITSUBA_PYTHON  a Python with mitsuba, and DRJIT_LIBLLVM_PATH  (pip install mitsuba; apt-get install libllvm19)
# BLENDER_PYTHON  a Python with bpy                              (pip install bpy)
# LOBELIA         the program; without it it is built
set -euo pipefail
cd "$(dirname "$0")/../.."

step() { printf '\n== %s\n' "$*"; }
capture=${1:-assets/examples/corner}
[ -n "${LOBELIA:-}" ] || cargo build --release --locked
lobelia=$(realpath "${LOBELIA:-target/release/lobelia}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
report=$work/results.txt
failed=0 skipped=0
printf 'lobelia %s, %s, capture %s\n' "$(git describe --always)" "$(date -u +%Y-%m-%d)" "$(basename "$capture")" >"$report"
# Runs a peer: its name, the version it says, and the command.
ask() {
    local name=$1 version=$2
    shift 2
    step "$name $version"
    if "$@" >"$work/said" 2>"$work/errors"; then
        sed "s|$work/||g" "$work/said"
        if grep -q '^skipped' "$work/said"; then skipped=$((skipped + 1)); fi
        { printf '\n%s %s\n' "$name" "$version"; sed "s|$work/||g" "$work/said"; } >>"$report"
    else
        failed=$((failed + 1))
        cat "$work/said" "$work/errors"
    fi
}

step "Reconstructed and exported"
"$lobelia" reconstruct "$capture" --out "$work/out" --quiet
"$lobelia" export "$capture" --solution "$work/out" --out "$work/scene" --format glb,obj,blender --quiet

node_version() { node -p 'require("gltf-validator").version()' 2>/dev/null || true; }
ask "glTF validator" "$(node_version)" \
    node tests/peers/gltf.js "$work/scene/scene.glb" "$work/scene/blender/scene.glb"
mitsuba=${MITSUBA_PYTHON:-python3}
ask Mitsuba "$("$mitsuba" -c 'import mitsuba; print(mitsuba.__version__)' 2>/dev/null || true)" \
    "$mitsuba" tests/peers/mitsuba_export.py "$lobelia" "$capture" "$work/out"
blender=${BLENDER_PYTHON:-python3}
ask Blender "$("$blender" -c 'import bpy; print(bpy.app.version_string)' 2>/dev/null || true)" \
    "$blender" tests/peers/blender_export.py "$work/scene/blender" "$(find "$capture/images" -name '*.exr' | sort | head -1)"

printf '\n== %d failed, %d skipped\n' "$failed" "$skipped"
[ "$failed" = 0 ] || exit 1
if [ "$skipped" = 0 ]; then
    cp "$report" tests/peers/results.txt
    echo "Written to tests/peers/results.txt"
fi
