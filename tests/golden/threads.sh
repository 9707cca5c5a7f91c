#!/usr/bin/env bash
# The state at the end of a scene has the same bits for 1, 2 and 4 threads.  usage: threads.sh OFFSTAGE SCENE
hashes=$(for threads in 1 2 4; do
  "$1" simulate "$2" --threads "$threads" -q | sed -n 's/.*"state_hash": "\(.*\)".*/\1/p'
done)
[ "$(echo "$hashes" | wc -l)" = 3 ] && [ "$(echo "$hashes" | sort -u | wc -l)" = 1 ] && exit 0
echo "$hashes"
exit 1
