#!/usr/bin/env bash
# Runs a layer of the tests and says how long it took, here and in build/layers.txt, which the caller empties.
#
#   cmake/layer.sh NAME COMMAND [NAME COMMAND ...]
#
# Several run side by side, for those that use one core only; then each one's output is shown when it ends.
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
said=$(mktemp -d)
trap 'rm -rf "$said"' EXIT
jobs=() status=0
for ((k = 0; $# > 0; k++)); do
    one "$1" "$2" >"$said/$k" 2>&1 &
    jobs+=($!)
    shift 2
done
for k in "${!jobs[@]}"; do
    wait "${jobs[$k]}" || status=$?
    cat "$said/$k"
done
exit $status
