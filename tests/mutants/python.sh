#!/usr/bin/env bash
# Changes what decides a verdict in Python in many small ways, by mutmut, and says which changes no test notices.
#
#   tests/mutants/python.sh PYTHON WORK
#
# WORK gets a copy in which the package lies where mutmut looks for it; pyproject.toml says which files are changed and
# which tests are to notice. The compiled core is that of the package that PYTHON imports.
set -euo pipefail
python=$(realpath -s "${1:?usage: python.sh PYTHON WORK}")
work=${2:?usage: python.sh PYTHON WORK}
core=$("$python" -c 'from debulk import _core; print(_core.__file__)')

rm -rf "$work"
mkdir -p "$work/bench" "$work/mutants/bench" # those that are looked at first must be there when Python starts
cp -r python/debulk tests pyproject.toml "$work"
cp -r bench/lab "$work/bench"
cp "$core" "$(dirname "$core")/core_sources.txt" "$work/debulk"
cd "$work"
PYTHONPATH=$PWD/mutants:$PWD/mutants/bench "$python" -m mutmut run --max-children "${MUTANTS_AT_ONCE:-2}" | tail -n 1
"$python" -m mutmut results | sort >survivors.txt
while read -r name _; do
    "$python" -m mutmut show "${name%:}"
done <survivors.txt >survivors.diff
cat survivors.txt
