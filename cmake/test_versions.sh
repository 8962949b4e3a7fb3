#!/usr/bin/env bash
# Tries debulk on the oldest or on the newest of everything that pyproject.toml allows.
#
#   cmake/test_versions.sh PYTHON BUILD oldest|newest ...
#
# BUILD holds a finished build for PYTHON; its rooms, which know nothing of Python, are linked into the other versions'
# modules. A CPython that this machine lacks is left out, in a sentence: it is looked for on the PATH and in pyenv. Both may run
# at once.
set -euo pipefail

python=${1:?usage: test_versions.sh PYTHON BUILD oldest|newest ...}
build=$(realpath "${2:?usage: test_versions.sh PYTHON BUILD oldest|newest ...}")
work=build/versions
# Fast, and between them in every part of the package: numbers, text, pages, files, the command line, threads.
tests=(tests/python/test_arrays.py tests/python/test_import.py tests/python/test_processes.py tests/python/test_pickling.py
       tests/python/recipe tests/python/results/test_report.py tests/python/files/test_files.py)

say() { printf 'debulk: %s\n' "$*"; }

find_python() { # VERSION
    local candidate
    for candidate in "$(command -v "python$1" || true)" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$1".*/bin/python"$1"; do
        # pyenv's shims are there for versions that are not, too.
        if [ -x "$candidate" ] && "$candidate" -c 'import venv' 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
}

# The requirements of one of pyproject.toml's lists, one a line; of the oldest versions allowed where that is asked for.
required() { # LIST oldest|newest
    "$python" - "$@" <<'PY'
import sys, tomllib

project = tomllib.load(open("pyproject.toml", "rb"))
lists = {"build": project["build-system"]["requires"], "run": project["project"]["dependencies"]}
for one in lists[sys.argv[1]]:
    print(one.replace(">=", "==") if sys.argv[2] == "oldest" else one)
PY
}

wheel_for() { # PYTHON_OF_THE_VERSION VERSION
    local wheels=$work/$2/wheels here
    rm -rf "$wheels"
    here=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    if [ "$here" = "$2" ]; then # nothing is compiled
        flock "$build" "$python" -m pip wheel --no-build-isolation --no-deps --wheel-dir "$wheels" --config-settings=build-dir="$build" .
    else # only the bindings are
        flock "$build" cmake --install "$build" --prefix "$work/rooms" --component cpp >"$work/rooms.log"
        required build newest >"$work/$2/build.txt"
        "$1" -m pip install -r "$work/$2/build.txt"
        "$1" -m pip wheel --no-build-isolation --no-deps --wheel-dir "$wheels" --config-settings=build-dir="$work/$2/build" \
            --config-settings=cmake.define.DEBULK_ROOMS="$PWD/$work/rooms" \
            --config-settings=cmake.define.CMAKE_COMPILE_WARNING_AS_ERROR=ON .
    fi
}

try() { # VERSION oldest|newest
    local found venv=$work/$1/venv log=$work/$1/log status=0
    found=$(find_python "$1")
    if [ -z "$found" ]; then
        say "no CPython $1 is here: debulk was not tried on it with the $2 of its requirements"
        return
    fi
    mkdir -p "$work/$1"
    say "CPython $1 with the $2 of its requirements"
    {
        [ -x "$venv/bin/python" ] || "$found" -m venv "$venv"
        required run "$2" >"$work/$1/run.txt"
        wheel_for "$venv/bin/python" "$1"
        "$venv/bin/python" -m pip install -r "$work/$1/run.txt" pytest hypothesis
        "$venv/bin/python" -m pip install --no-deps --force-reinstall "$work/$1"/wheels/*.whl
        "$venv/bin/python" -m pip list
    } >"$log" 2>&1 </dev/null || { tail -n 40 "$log" >&2; exit 1; }
    "$venv/bin/debulk" demo -o "$work/$1/demo" >>"$log" 2>&1 || status=$?
    [ $status -le 1 ] || [ $status -eq 4 ] || { tail -n 40 "$log" >&2; say "debulk demo ended with $status" >&2; exit 1; }
    "$venv/bin/python" -m pytest -q -p no:cacheprovider "${tests[@]}"
}

shift 2
for edge in "$@"; do
    case $edge in
        oldest) try 3.11 oldest ;;
        newest) try 3.13 newest ;;
        *) say "$edge is neither oldest nor newest" >&2; exit 2 ;;
    esac
done
