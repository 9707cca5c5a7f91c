#!/usr/bin/env bash
# Draws the pictures of docs/scene-guide.md:  docs/guide/pictures.sh [STEP...]     such as 05_wheel; without STEP: all of them
# Needs build/offstage and ffmpeg.
set -euo pipefail
cd "$(dirname "$0")/../.."

# Of each step the moment that shows it best, in seconds.
moments="01_ball:0.7 02_balls:1 03_stack:1 04_tub:0.6 05_wheel:1.3 06_rope:0.5 07_break:0.9 08_cloth:1.2 09_water:1 10_mill:2"

png=$(mktemp --suffix .png)
trap 'rm -f "$png"' EXIT
for shot in $moments; do
  step=${shot%:*}
  if [ $# -gt 0 ] && [[ " $* " != *" $step "* ]]; then continue; fi
  build/offstage frame "docs/guide/$step.json" --at "${shot#*:}" -o "$png" --force --size 480x270 --quality preview -q >&2
  ffmpeg -y -loglevel error -i "$png" -q:v 3 "docs/guide/$step.jpg"
done
