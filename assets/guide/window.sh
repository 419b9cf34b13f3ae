# Sourced by walk.sh, model.sh, hour.sh, table.sh and castle.sh, which set `walk` to their own names: a screen that
# nobody sees, the studio on it, keys, and pictures. $1 is the theme, $2 the folder of the pictures.
#
# Nothing of the user's settings is read or written. LOBELIA names another program, WALK_SCREEN another
# size of the screen (1280x720), WALK_SCALE another size of text (1), WALK_PATIENCE how many times as long the
# hand waits (1; on a busy machine 4, or keys come before the window has taken those before).
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
# No session bus: file dialogs would stand on the user's own screen. The window has a field for the path then.
export DBUS_SESSION_BUS_ADDRESS=unix:path=$work/none
mkdir -p "$XDG_CONFIG_HOME/lobelia" "$XDG_RUNTIME_DIR"
chmod 700 "$XDG_RUNTIME_DIR"
echo "{\"theme\": \"$theme\", \"scale\": $WALK_SCALE, \"window\": [${WALK_SCREEN/x/, }]}" >"$XDG_CONFIG_HOME/lobelia/studio.json"
Xvfb "$DISPLAY" -screen 0 "${WALK_SCREEN}x24" -noreset >/dev/null 2>&1 &
server=$!
window=
trap 'kill $window $server 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "$walk.sh: $*" >&2; import -window root "$out/failed.png" || true; exit 1; }
pause() { sleep "$(awk "BEGIN { print $1 * ${WALK_PATIENCE:-1} }")"; }
keys() { xdotool key --delay 60 "$@"; pause 0.7; }
text() { xdotool type --delay 15 "$1"; pause 0.5; }
# The pointer moves before it presses, as a hand does.
click() {
    xdotool mousemove "$1" "$2" mousemove "$(($1 + 2))" "$2"
    pause 0.3
    xdotool click 1
    pause 0.8
}
aside() { xdotool mousemove 640 716; pause 0.3; }
# What a command is called in the palette finds it.
command_() { keys ctrl+p; text "$1"; keys Return; pause 0.5; }
# Whether two pictures differ by at most as many pixels.
differ_by() { [ "$(compare -metric AE "$1" "$2" null: 2>&1)" -le "$3" ]; }
# The lower left corner, where the window says what it does; "Ready" at rest.
state() { import -window root -crop 44x22+0+697 +repage "$1"; }
is_ready() { state "$work/now.png"; differ_by "$work/ready.png" "$work/now.png" 0; }
# Waits until the job has ended: as many half seconds at most.
wait_ready() {
    for _ in $(seq "${1:-1200}"); do is_ready && return; sleep 0.5; done
    fail "the window did not come to rest"
}
# Waits until a job has begun, and then until it has ended.
wait_job() {
    for _ in $(seq 120); do is_ready || break; sleep 0.1; done
    wait_ready "$@"
}
# A picture once nothing moves any more: notices have gone, photographs are there.
picture() {
    aside
    import -window root "$work/before.png"
    for _ in $(seq "${2:-20}"); do
        pause 1
        import -window root "$work/after.png"
        differ_by "$work/before.png" "$work/after.png" 0 && break
        mv "$work/after.png" "$work/before.png"
    done
    still "$1"
}
# Waits until the window has done all that it was told: its own thread, and those that draw for it, sleep.
# A job in another thread may go on. As many seconds at most.
settle() {
    sleep 0.1
    python3 - "$window" "${1:-10}" <<'PY'
import os, sys, time

process, until, quiet = sys.argv[1], time.monotonic() + float(sys.argv[2]), 0
while time.monotonic() < until and quiet < 12:
    runs = False
    try:
        for thread in os.listdir(f"/proc/{process}/task"):
            head, _, tail = open(f"/proc/{process}/task/{thread}/stat").read().rpartition(")")
            name = head.split("(", 1)[1]
            draws = thread == process or name.startswith(("llvmpipe", "vk"))
            runs |= draws and tail.split()[0] != "S"
    except (FileNotFoundError, ProcessLookupError):
        if not os.path.exists(f"/proc/{process}"):
            break
    quiet = 0 if runs else quiet + 1
    time.sleep(0.02)
PY
}
still() { import -window root -colors 256 "PNG8:$out/$1.png"; echo "$1"; }

start() {
    for _ in $(seq 240); do xdotool getdisplaygeometry >/dev/null 2>&1 && break; sleep 0.25; done
    "$program" "$@" >"$work/window.log" 2>&1 &
    window=$!
    for _ in $(seq 60); do
        xdotool search --name Lobelia windowfocus >/dev/null 2>&1 && break
        kill -0 "$window" 2>/dev/null || fail "the window did not open: $(cat "$work/window.log")"
        sleep 0.5
    done
    pause 2
}
