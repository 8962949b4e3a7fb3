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
python=$1 seconds=$2 runs=${3:--1} seed=${4:-0}
export PYTHONHASHSEED=0
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
corpus=$root/build/fuzz_corpus
mkdir -p "$corpus/failed"
tar -xJf "$root/tests/fuzz/corpus.tar.xz" -C "$corpus" --skip-old-files
(cd "$root" && cmake --preset fuzz && cmake --build --preset fuzz) >"$corpus/build.log"

options=("-max_total_time=$seconds" "-runs=$runs" "-seed=$seed" -timeout=60)
mkdir -p "$corpus/readers"
"$root/build/fuzz/tests/fuzz/fuzz_readers" "$corpus/readers" "-artifact_prefix=$corpus/failed/readers-" "${options[@]}" >"$corpus/readers.log" 2>&1 &
readers=$! status=0
"$python" "$root/tests/fuzz/fuzz.py" "$corpus" "${options[@]}" >>"$corpus/build.log" 2>&1 || {
    status=1
    grep -v Instrumenting "$corpus/build.log" | tail -n 20
}
wait $readers || status=1

for log in "$corpus"/*.log; do
    name=$(basename "$log" .log)
    [ "$name" = build ] && continue
    ended=$(grep -o 'Done [0-9]* runs.*' "$log") || { ended=FAILED status=1; }
    echo "debulk: fuzzed $name: $ended"
    [ "$ended" != FAILED ] || tail -n 40 "$log"
done
exit $status
