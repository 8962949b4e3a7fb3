#!/usr/bin/env bash
# Runs a layer of the tests and says how long it took, here and in build/layers.txt, which the caller empties.
#
#   cmake/layer.sh NAME COMMAND [NAME COMMAND ...]
#
# Several run two at a time, each on one core or waiting for others. Each one's output is shown when it ends, and all run, also
# when one fails.
set -uo pipefail
mkdir -p build
times=build/layers.txt

one() { # NAME COMMAND
    local start=$SECONDS status=0 line
    bash -euo pipefail -c "$2" || status=$?
    printf -v line '%-32s %5d s%s' "$1" $((SECONDS - start)) "$([ $status -eq 0 ] || echo '  FAILED')"
    echo "$line" >>"$times"
    echo "debulk: $line"
    return $status
}

if [ $# -eq 2 ]; then
    one "$1" "$2"
    exit
fi
# xargs would start no more after a status of 255.
printf '%s\0' "$@" | xargs -0 -n 2 -P 2 bash -c 'said=$("$0" "$@" 2>&1); status=$?
    flock "$0" cat <<<"$said"; exit $((status != 0))' "$0"
