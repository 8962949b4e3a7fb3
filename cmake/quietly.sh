#!/usr/bin/env bash
# Runs a command whose output only matters when it fails: it goes into a log, and a terminal shows how far a build is.
#
#   cmake/quietly.sh LOG COMMAND [ARGUMENT ...]
set -euo pipefail

log=${1:?usage: quietly.sh LOG COMMAND [ARGUMENT ...]}
shift
mkdir -p "$(dirname "$log")"
printf '\n$ %s\n' "$*" >>"$log"
began=$(wc -l <"$log")

# Ninja's "[12/143] ..." and what pip collects move on one line of the terminal; elsewhere each quarter of the build is told.
progress() {
    local line quarter last=0
    while IFS= read -r line; do
        if [[ $line =~ \[([0-9]+)/([0-9]+)\] ]]; then
            quarter=$((4 * BASH_REMATCH[1] / BASH_REMATCH[2]))
            if [ -t 2 ]; then
                printf '\r\033[K  [%s/%s] ' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
            elif [ "$quarter" -gt "$last" ]; then
                printf '  [%s/%s]\n' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
            fi
            last=$quarter
        elif [ -t 2 ] && [[ $line =~ ^\ *(Collecting|Downloading|Installing\ collected)\ ([A-Za-z0-9._-]*) ]]; then
            printf '\r\033[K  %s %s ' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
        fi
    done
    [ ! -t 2 ] || printf '\r\033[K' >&2
}

status=0
"$@" </dev/null 2>&1 | tee -a "$log" | progress || status=$?
if [ "$status" -ne 0 ]; then
    tail -n "+$began" "$log" | tail -n 40 >&2
    printf 'debulk: this step failed: %s\ndebulk: the whole log: %s\n' "$*" "$log" >&2
    exit "$status"
fi
