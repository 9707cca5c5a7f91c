#!/usr/bin/env bash
# Compares the CPU time of effects with Blender 3.4.1, on the scenes of tests/bench/blender: tests/bench/blender.sh [PROGRAM [RUNS]].
# Simulation: time of all frames minus the start-up, per frame. Drawing, from a cache: preview quality, including PNG; time of eight
# frames minus the time of one, per frame.
# Prints medians of RUNS. RESULTS.md says how Blender was measured: EEVEE with 4 samples on the same machine.
set -euo pipefail
cd "$(dirname "$0")"
program=$(realpath "${1:-../../build/offstage}")
runs=${2:-5}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

TIMEFORMAT='%U %S'
# cpu COMMAND...: prints the sum of user and system time of the command [s].
cpu() { { time "$@" >/dev/null 2>"$folder/log"; } 2>&1 | awk '{print $1 + $2}'; }
median() { sort -n | awk '{v[NR] = $1} END {print v[int((NR + 1) / 2)]}'; }
simulate() { "$program" simulate "blender/$1.json" -q "${@:2}"; }
draw() { "$program" render "blender/$1.json" --quality preview --cache "$folder/cache" --frames "$2" -o "$folder/out/" --force -q; }
per_frame() { awk -v all="$1" -v few="$2" -v frames="$3" 'BEGIN {print (all - few) / frames}'; }

printf '%-14s %21s %29s\n' 'scene' 'simulation [ms/frame]' 'drawing [CPU s/frame]'
printf '%-14s %6s %7s %6s %9s %8s %9s\n' '' 'ours' 'Blender' 'ratio' 'ours' 'Blender' 'ratio'
while read -r scene frames shown blender_ms blender_s; do
  simulate "$scene" --cache "$folder/cache" --force >/dev/null
  for _ in $(seq "$runs"); do
    per_frame "$(cpu simulate "$scene")" "$(cpu simulate "$scene" --set output.duration=0.04)" $((frames - 1)) >>"$folder/sim"
    per_frame "$(cpu draw "$scene" $((shown - 8))-"$shown")" "$(cpu draw "$scene" "$shown")" 8 >>"$folder/draw"
  done
  awk -v scene="$scene" -v sim="$(median <"$folder/sim")" -v draw="$(median <"$folder/draw")" -v b_sim="$blender_ms" -v b_draw="$blender_s" 'BEGIN {
    printf "%-14s %6.2f %7.1f %6.2f %9.3f %8.1f      1/%.0f\n", scene, 1000 * sim, b_sim, 1000 * sim / b_sim, draw, b_draw, b_draw / draw}'
  rm -rf "$folder"/sim "$folder"/draw "$folder/cache"
done <<'EOF'
sprinkler10k 96 80 2.7 10.0
sprinkler100k 96 80 26.9 24.4
rain20k 72 60 3.7 9.7
fireworks 72 40 1.2 6.2
ball_smoke 96 80 0.6 33.5
fluid_smoke 48 44 273 10.0
EOF
