#!/usr/bin/env bash
# Runs a libFuzzer target.  usage: fuzz.sh TARGET SECONDS NEW_CORPUS CORPUS
# A crash, a run of over 25 s (sanitized code is at least five times slower) or memory over 2.5 GB fails; the input is left
# beside the new corpus.
set -euo pipefail
mkdir -p "$3"
exec "$1" -max_total_time="$2" -timeout=25 -rss_limit_mb=2560 -print_final_stats=1 -artifact_prefix="$3"/../ "$3" "$4"
