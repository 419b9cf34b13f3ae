#!/usr/bin/env bash
# From real photographs to a relit picture, with a mouse and keys that nobody holds: twenty photographs of
# a table, no cameras and no mesh. Cameras are found, the table is a plane from points, a poster is a
# polygon, a carton a box; all are tagged, reconstructed, and lit by a lamp that was not there. Counts what
# the hand does and the seconds, prints both, and keeps a picture of every step.
#
#   assets/guide/table.sh PHOTOGRAPHS [dark|light] [FOLDER]
#
# PHOTOGRAPHS is the folder images/robot of tabletop_robot (sangminkim-99/COLMAP_multicam on GitHub),
# 640x480, without a licence and therefore not in this repository. Needs what walk.sh needs, and openmvg-rs
# as a package of a python3 on the search path. Places in the window are those of a fresh start at
# 1280x720, so that WALK_SCREEN and WALK_SCALE must not be given.
photographs=$(cd "${1:?the folder of the photographs}" && pwd)
shift
walk=table
. "$(dirname "$0")/hand.sh"

begin_from_photographs "$photographs" 505
step table-1-cameras

click 1238 43
# All posters at once are about the plane of the table, which is the floor.
press l
drag 250 300 290 95 560 130 545 270 690 270 700 220 895 220 895 500 920 500 830 585 400 585 420 330
sleep 4
click 1145 366
click 1074 397
sleep 2
# A poster that lies on it: its corners in one photograph, each where two lines cross.
press g
click 1145 366
click 1074 397
click 695 500; click 885 500; click 885 228; click 703 228
sleep 3
# Its long side is that of a sheet of A4.
press k
drag 697 500 705 228
press ctrl+a
text 0.297
press Return
sleep 3
saved 'things == ["polygon1", "polygon2"] and len(picks) > 12' || fail "the posters were not drawn"
step table-2-planes

# A carton, by seven corners in each of two photographs; its back bottom corner is hidden.
press Next; sleep 2
press b
click 496 169; click 640 211; click 652 187; press space
click 493 116; click 651 148; click 664 125; click 507 78
press Next Next; sleep 3
click 602 162; click 719 250; click 747 230; press space
click 605 111; click 730 207; click 772 174; click 636 83
press v
sleep 3
saved 'len(picks) > 26 and things[-1] == "box1"' || fail "the carton was not drawn"
step table-3-box

press ctrl+m
wait_until "the mesh" 60 test -s "$work/$walk/scene.obj"
sleep 5
press F3
click 1019 203   # Take for radiance (sRGB)
wait_ready 60
press F2
for row in 217 242; do   # the table and the poster in the list of materials
    click 1021 "$row"
    click 945 334   # Textured
done
step table-4-tags
press F3 ctrl+r
sleep 5
wait_ready "${TABLE_RUNNING:-900}"
step table-5-run
press F5
command_ "add area light"
sleep "${TABLE_RELIT:-20}"
step table-6-relit
press ctrl+q
echo "$((SECONDS - began)) s, $hands movements of the hand; the pictures are in $out"
