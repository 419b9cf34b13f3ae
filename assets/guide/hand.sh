# Sourced by table.sh and castle.sh: the window of window.sh, and a hand in it. What the hand does is counted and
# timed, and files tell what it has made.
. "$(dirname "${BASH_SOURCE[0]}")/window.sh"

hands=0 began=$SECONDS
# Movements of the hand: clicks, drags, keys (combinations count once), texts.
text() { hands=$((hands + 1)); xdotool type --delay 15 "$1"; sleep 0.5; }
press() { hands=$((hands + $#)); for key in "$@"; do keys "$key"; done; }
click() {
    hands=$((hands + 1))
    xdotool mousemove "$1" "$2" mousemove "$(($1 + 2))" "$2"
    sleep 0.4; xdotool mousedown 1; sleep 0.2; xdotool mouseup 1; sleep 0.8
}
# A drag through places.
drag() {
    local x=$1 y=$2 part
    hands=$((hands + 1))
    xdotool mousemove "$x" "$y"; sleep 0.4; xdotool mousedown 1; sleep 0.2
    shift 2
    while [ $# -gt 1 ]; do
        for part in 1 2 3 4; do
            xdotool mousemove $((x + ($1 - x) * part / 4)) $((y + ($2 - y) * part / 4)); sleep 0.05
        done
        x=$1 y=$2
        shift 2
    done
    sleep 0.3; xdotool mouseup 1; sleep 1
}
command_() { press ctrl+p; text "$1"; press Return; }
step() { still "$1"; echo "  after $((SECONDS - began)) s, $hands movements of the hand"; }
# Waits until a command succeeds: "the model" 60 test -f FILE.
wait_until() {
    local what=$1 most=$2 _
    shift 2
    for _ in $(seq $((2 * most))); do "$@" && return; sleep 0.5; done
    fail "$what did not come"
}
wait_ready() { xdotool mousemove 640 716; wait_until "rest" "$1" is_ready; }
# Whether the model that is saved is as a Python expression over things and picks says.
saved() { press ctrl+s; sleep 1; python3 - "$work/$walk/model.json" "$1" <<'PY'
import json, sys
model = json.load(open(sys.argv[1]))
things = [thing["id"] for thing in model.get("things", [])]
picks = [stroke for stroke in model.get("strokes", []) if stroke["kind"] == "pick"]
sys.exit(f"{things}, {len(picks)} picks: {sys.argv[2]} is not so" if not eval(sys.argv[2]) else 0)
PY
}

# From the start page to the cameras that an engine found, in the folder $work/$walk: begin_from_photographs FOLDER
# Y, where Y is how far down the dialog's field for the folder is once it lists the photographs.
begin_from_photographs() {
    start
    xdotool mousemove 640 716; sleep 1
    state "$work/ready.png"
    press ctrl+n; sleep 3
    click 425 350; sleep 3
    text "$1"
    press Return; sleep 2
    click 597 "$2"
    press ctrl+a
    text "$work/$walk"
    press Tab
    click 386 "$(($2 + 33))"
    wait_until "the capture" 60 test -f "$work/$walk/transforms.json"
    sleep 6
    click 60 62   # Find cameras…
    sleep 2
    click 1119 270
    wait_until "the cameras" 120 test -f "$work/$walk/model.unsaved.json"
    sleep 3
}
