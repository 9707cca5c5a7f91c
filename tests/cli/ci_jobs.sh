#!/usr/bin/env bash
# The jobs of demos/ci are valid YAML, and their command has the effect that docs/ci.md describes:  ci_jobs.sh OFFSTAGE SOURCE_DIR
set -euo pipefail
offstage=$(realpath "$1")
source=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir bin scenes
ln -s "$offstage" bin/offstage
export PATH=$work/bin:$PATH
scene='{"version": 1, "bodies": [{"shape": {"type": "sphere"}, "velocity": [0, SPEED, 0]}],
  "render": {"size": [64, 36], "quality": "draft"}, "output": {"fps": 10, "duration": 0.4}}'
for speed in 1 2; do echo "${scene/SPEED/$speed}" >scenes/ball_$speed.json; done
env -u CI offstage bless scenes/*.json --golden goldens --reason new >/dev/null

# command FILE: prints the command of the job that compares goldens.
command() { grep -oE 'offstage compare .*' "$1"; }
for job in github gitlab; do
  echo "${scene/SPEED/2}" >scenes/ball_2.json
  rm -rf report results.xml
  bash -euc "$(command "$source/demos/ci/$job.yml")" >log || { cat log; exit 1; }
  [ -s results.xml ] && [ -s report/index.html ]
  echo "${scene/SPEED/2.1}" >scenes/ball_2.json
  code=0
  bash -euc "$(command "$source/demos/ci/$job.yml")" >log || code=$?
  [ $code = 6 ] || { echo "exit code $code"; cat log; exit 1; }
  grep -q '<failure type="images differ"' results.xml
  [ -s report/ball_2/ball_2-0001-difference.png ]
done
