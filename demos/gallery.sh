#!/usr/bin/env bash
# Draws docs/gallery.jpg, the README's picture, from the scenes as they are now. Needs build/offstage.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

shots="sprinkler:3.3 rain:4 fountain:5 machine:4.35 t_handle:1 landscape:3 collision:4.2"
inputs=()
for shot in $shots; do
  picture=$folder/${shot%:*}.png
  build/offstage frame "demos/scenes/${shot%:*}.json" --at "${shot#*:}" -o "$picture" --size 640x360 --quality final -q >&2
  inputs+=(-i "$picture")
done
ffmpeg -y -loglevel error "${inputs[@]}" -q:v 3 -filter_complex \
  "[0][1][2]hstack=inputs=3[top];[3][4][5][6]hstack=inputs=4,scale=1920:-2[bottom];[top][bottom]vstack,scale=1536:-2" docs/gallery.jpg
