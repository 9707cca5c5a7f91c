#!/usr/bin/env bash
# The commands of docs/book.md run, and compare the scene's methods with others:  book.sh OFFSTAGE SOURCE_DIR
set -euo pipefail
cd "$2"
failed=0
count=0
while read -r arguments; do
  count=$((count + 1))
  # Two frames are enough to see that the scene and all choices are accepted.
  arguments=$(sed -E 's/ --duration [0-9.]+//' <<<"$arguments")
  read -ra words <<<"$arguments"
  rows=$("$1" bench "${words[@]}" --duration 0.07 --progress none | grep -c ' 0$' || true)
  [ "$rows" -ge 10 ] || { echo "docs/book.md: 'offstage bench $arguments' has $rows rows without a fault" >&2; failed=1; }
done < <(grep -oE 'offstage bench [^`#]*' docs/book.md | sed -E 's/offstage bench //; s/ +$//' | grep json | sort -u)
[ "$count" -ge 4 ] || { echo "docs/book.md has $count commands" >&2; failed=1; }
exit $failed
