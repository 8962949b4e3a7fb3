#!/usr/bin/env bash
# Fuzzes every reader and loader, two at a time. Needs clang and Atheris.
#
#   cmake/fuzz.sh PYTHON SECONDS [RUNS SEED]
#
# Each target ends after so many seconds, or after so many runs if that is sooner. The same seed (0: another one each
# time) tries the same inputs as far as it gets.
#
# A run begins with tests/fuzz/corpus.tar.xz. What raised the coverage stays in build/fuzz_corpus, and the next run goes on
# from there. An input that fails is kept in build/fuzz_corpus/failed, and the run ends with an error.
set -euo pipefail
export python=$1 seconds=$2 runs=${3:--1} seed=${4:-0} PYTHONHASHSEED=0
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export root corpus=$root/build/fuzz_corpus
mkdir -p "$corpus/failed"
tar -xJf "$root/tests/fuzz/corpus.tar.xz" -C "$corpus" --skip-old-files
(cd "$root" && cmake --preset fuzz && cmake --build --preset fuzz) >"$corpus/build.log"

one() {
    local program=("$python" "$root/tests/fuzz/fuzz.py" "$1")
    [ "$1" = readers ] && program=("$root/build/fuzz/tests/fuzz/fuzz_readers")
    mkdir -p "$corpus/$1"
    local log=$corpus/$1.log status=0
    "${program[@]}" "$corpus/$1" "-max_total_time=$seconds" "-runs=$runs" "-seed=$seed" -timeout=60 "-artifact_prefix=$corpus/failed/$1-" \
        >"$log" 2>&1 || status=1
    echo "debulk: fuzzed $1: $(grep -o 'Done [0-9]* runs.*' "$log" || echo FAILED)"
    [ $status -eq 0 ] || tail -n 40 "$log"
    return $status
}
export -f one

targets=$(cd "$root/tests/fuzz" && "$python" -c 'from targets import TARGETS; print(*TARGETS, sep="\n")')
printf '%s\n' readers "$targets" | xargs -P 2 -I{} bash -c 'one {}'
