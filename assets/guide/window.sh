# Sourced by walk.sh, model.sh, hour.sh and table.sh, which set `walk` to their own names: a screen that nobody sees,
# the studio on it, keys, and pictures. $1 is the theme, $2 the folder of the pictures.
#
# Nothing of the user's settings is read or written. LOBELIA names another program, WALK_SCREEN another
# size of the screen (1280x720), WALK_SCALE another size of text (1).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

theme=${1:-dark}
WALK_SCREEN=${WALK_SCREEN:-1280x720}
WALK_SCALE=${WALK_SCALE:-1}
out=$(mkdir -p "${2:-out/$walk-$theme}" && cd "${2:-out/$walk-$theme}" && pwd)
program=${LOBELIA:-$PWD/target/release/lobelia}
for tool in Xvfb xdotool import compare python3 "$program"; do
    command -v "$tool" >/dev/null || { echo "$walk.sh: $tool is missing" >&2; exit 1; }
done

work=$(mktemp -d)
export XDG_CONFIG_HOME=$work/config XDG_STATE_HOME=$work/state XDG_RUNTIME_DIR=$work/run DISPLAY=:${WALK_DISPLAY:-87}
mkdir -p "$XDG_CONFIG_HOME/lobelia" "$XDG_RUNTIME_DIR"
chmod 700 "$XDG_RUNTIME_DIR"
echo "{\"theme\": \"$theme\", \"scale\": $WALK_SCALE, \"window\": [${WALK_SCREEN/x/, }]}" >"$XDG_CONFIG_HOME/lobelia/studio.json"
Xvfb "$DISPLAY" -screen 0 "${WALK_SCREEN}x24" >/dev/null 2>&1 &
server=$!
window=
trap 'kill $window $server 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "$walk.sh: $*" >&2; import -window root "$out/failed.png" || true; exit 1; }
keys() { xdotool key --delay 60 "$@"; sleep 0.7; }
still() { import -window root -colors 256 "PNG8:$out/$1.png"; echo "$1"; }

start() {
    for _ in $(seq 40); do xdotool getdisplaygeometry >/dev/null 2>&1 && break; sleep 0.25; done
    "$program" "$@" >"$work/window.log" 2>&1 &
    window=$!
    for _ in $(seq 60); do
        xdotool search --name Lobelia windowfocus >/dev/null 2>&1 && break
        kill -0 "$window" 2>/dev/null || fail "the window did not open: $(cat "$work/window.log")"
        sleep 0.5
    done
    sleep 2
}
