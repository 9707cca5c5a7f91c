#!/usr/bin/env bash
# Every scene of the tutorial is valid and has no warnings, except about unused materials:  guide.sh OFFSTAGE SOURCE_DIR
set -euo pipefail
failed=0
count=0
for scene in "$2"/docs/guide/*.json; do
  count=$((count + 1))
  "$1" validate --quick "$scene" >/dev/null || { echo "$scene is not valid" >&2; failed=1; }
done
[ "$count" -ge 10 ] || { echo "docs/guide has $count scenes, the tutorial has ten steps" >&2; failed=1; }
exit $failed
