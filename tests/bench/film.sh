#!/usr/bin/env bash
# Times whole renders of the program, end to end: tests/bench/film.sh [RUNS]. Prints each run's figures as it goes.
set -euo pipefail
cd "$(dirname "$0")/../.."
runs=${1:-5}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# median NAME: prints the median of the numbers on standard input.
median() { sort -n | awk -v name="$1" '{v[NR] = $1} END {printf "%s: median %.3f  (min %.3f, max %.3f, %d runs)\n", name, v[int((NR + 1) / 2)], v[1], v[NR], NR}'; }
# field KEY: prints a top-level number of the statistics.
field() { sed -n "s/^  \"$1\": \([0-9.]*\).*/\1/p" "$folder/stats.json"; }
render() { build/offstage render "$1" -o "$folder/out/" --force -q --stats "$folder/stats.json" "${@:2}"; }

for _ in $(seq "$runs"); do
  render tests/bench/empty.json --frames 1 >/dev/null
  field startup_s
done | median "start to first written frame of an empty scene [s]"

for quality in draft:60 preview:24 final:12; do
  for _ in $(seq "$runs"); do
    render tests/bench/film.json --quality "${quality%:*}" --frames "1-${quality#*:}" >/dev/null
    echo "$(field frames) $(field wall_s)" | awk '{print $1 / $2}'
  done | median "film.json 1280x720 ${quality%:*} [frames/s]"
done
