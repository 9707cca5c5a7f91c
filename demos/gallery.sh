#!/usr/bin/env bash
# Draws a picture of every scene. Writes demos/README.md, a page of these pictures, and docs/gallery.jpg, the strip in README.md:
#   demos/gallery.sh [NAME...]     draws only these scenes again
# Needs build/offstage and ffmpeg. The descriptions are the comments at the start of the scene files.
set -euo pipefail
cd "$(dirname "$0")/.."

# Chapters with their scenes, and for each scene the time of its picture [s].
chapters=(
  "Rigid bodies|wall:1.6 dominoes:2 arch:4.7 marbles:1.5 pile:0.9 explosion:1.5 coins:0.2 cradle:0.4 cradle_simultaneous:0.4 t_handle:3 collision:4 forces:2.25 machine:4.35 pushers:4.1 boules:2.2 book:1 toybox:2 workbench:1.4 glass:2.2 studio:0.7 evening:2.5"
  "Articulated bodies|wrecking_chain:1.45 ragdolls:1.4 bridge:1.6 double_pendulums:12 linkage:5 gyroscope:7 robot_arm:5 crane:4.7 vehicle:7 multi_pendulum:1.2 tentacle:5 gears:1.4 playground:1.5"
  "Cloth|drape:3.5 flag:3 curtain:1.9 sheets:3 rotating_sphere:3 tablecloth:1.68 hammock:5 torn_banner:4 parachute:1.2 balloons:2.07 swatches:2.6 laundry:2.4"
  "Water and weather|fountain:5 jet_fountain:3 sprinkler:3.3 lawn_sprinkler:3 water_jet:5.8 rain:4 rain_square:3 hail:3 snow:5 thunderstorm:3"
  "Smoke and fire|smoke:6 fire:4 fireworks:8 sparks:3 rocket_exhaust:3.2 grenade:0.72 dust:3 rocket_sled:2"
  "Particles|landscape:3 galton:5.5 hopper:2.4 crossing_jets:3 autumn:4 plume:1.6 balance:6 fields:2.4"
)
strip="wall dominoes arch marbles pile explosion glass cradle sprinkler rain fountain machine flag landscape drape smoke fire fireworks sparks rocket_exhaust"

mkdir -p demos/pictures
draw() {  # SCENE TIME
  local png
  png=$(mktemp --suffix .png)
  build/offstage frame "demos/scenes/$1.json" --allow assets --at "$2" -o "$png" --force --size 640x360 --quality final -q >&2
  ffmpeg -y -loglevel error -i "$png" -q:v 4 "demos/pictures/$1.jpg"
  rm "$png"
}
words() { sed -n '/^\/\//!q; s/^\/\/ *//p' "demos/scenes/$1.json" | tr '\n' ' ' | sed 's/ *$//; s/[^.]$/&./'; }

listed=" "
{
  echo "# Gallery"
  echo
  echo "Each scene is one file of \`demos/scenes\`; \`demos/run.sh NAME\` builds the program and renders its film. This page is written by"
  echo "\`demos/gallery.sh\`."
  for chapter in "${chapters[@]}"; do
    printf '\n## %s\n' "${chapter%%|*}"
    for shot in ${chapter#*|}; do
      name=${shot%:*}
      [ -f "demos/scenes/$name.json" ] || continue
      listed+="$name "
      if [ $# -eq 0 ] || [[ " $* " == *" $name "* ]] || [ ! -f "demos/pictures/$name.jpg" ]; then draw "$name" "${shot#*:}"; fi
      printf '\n### %s\n\n![%s](pictures/%s.jpg)\n\n%s\n' "$name" "$name" "$name" "$(words "$name")"
    done
  done
} >demos/README.md
for scene in demos/scenes/*.json; do
  name=$(basename -s .json "$scene")
  [[ $listed == *" $name "* ]] || echo "warning: $name is in no chapter of demos/gallery.sh" >&2
done

inputs=()
count=0
for name in $strip; do
  [ -f "demos/pictures/$name.jpg" ] && inputs+=(-i "demos/pictures/$name.jpg") && count=$((count + 1))
done
columns=5 rows=$((count / 5))
layout=$(for k in $(seq 0 $((columns * rows - 1))); do printf '%d_%d|' $((k % columns * 640)) $((k / columns * 360)); done)
ffmpeg -y -loglevel error "${inputs[@]:0:$((2 * columns * rows))}" -q:v 3 \
  -filter_complex "xstack=inputs=$((columns * rows)):layout=${layout%|},scale=1920:-2" docs/gallery.jpg
