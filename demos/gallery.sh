#!/usr/bin/env bash
# Draws docs/gallery.jpg, the README's picture, from the scenes as they are now. Needs build/offstage.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

shots="wall:1.6 dominoes:2 arch:4.7 marbles:1.5 pile:0.9 explosion:1.5 coins:2 cradle:0.4 sprinkler:3.3 rain:4 fountain:5 machine:4.35
  flag:4 landscape:3 drape:3.5 smoke:6 fire:4 fireworks:5 sparks:3 rocket_exhaust:3.5"
inputs=()
for shot in $shots; do
  picture=$folder/${shot%:*}.png
  build/offstage frame "demos/scenes/${shot%:*}.json" --at "${shot#*:}" -o "$picture" --size 640x360 --quality final -q >&2
  inputs+=(-i "$picture")
done
ffmpeg -y -loglevel error "${inputs[@]}" -q:v 3 -filter_complex \
  "[0][1][2][3][4]hstack=inputs=5[a];[5][6][7][8][9]hstack=inputs=5[b];[10][11][12][13][14]hstack=inputs=5[c];\
[15][16][17][18][19]hstack=inputs=5[d];[a][b][c][d]vstack=inputs=4,scale=1920:-2" docs/gallery.jpg
