#!/usr/bin/env bash
# Fills a folder with all that a cell without a network installs debulk from: for each Python its wheel, and the wheels
# that this one requires.
#
#   cmake/make_wheelhouse.sh FOLDER OWN BUILD PYTHON...
#
# BUILD holds a finished build for OWN, a Python with the packages of the extra "wheel". A PYTHON of OWN's version gets
# that build. Any other needs its headers (Debian: python3-dev) and gets an environment and bindings of its own, linked
# with BUILD's rooms, which know nothing of Python.
set -euo pipefail

usage='usage: make_wheelhouse.sh FOLDER OWN BUILD PYTHON...'
folder=${1:?$usage}
own=${2:?$usage}
build=${3:?$usage}
shift 3
[ $# -gt 0 ] || { echo 'debulk: no PYTHON was given' >&2; exit 2; }
pip=(-m pip --quiet --disable-pip-version-check)
work=$PWD/build/wheels

version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }

mkdir -p "$folder" "$work"
rm -f "$folder"/*.whl
cmake --install "$build" --prefix "$work/rooms" --component cpp >"$work/rooms.log"
for python in "$@"; do
    version=$(version_of "$python")
    venv=$own
    if [ "$version" = "$(version_of "$own")" ]; then # nothing is compiled
        echo "debulk: a wheel for Python $version"
        cmake/make_wheel.sh "$venv" "$folder" "$build"
    else # only the bindings are
        echo "debulk: a wheel for Python $version (a minute or two on two cores)"
        "$python" -m venv "$work/venv-$version"
        venv=$work/venv-$version/bin/python
        needed=$("$venv" -c '
import tomllib
p = tomllib.load(open("pyproject.toml", "rb"))
lists = p["build-system"]["requires"], p["project"]["optional-dependencies"]["wheel"], p["project"]["dependencies"]
print(*(one for some in lists for one in some), sep="\n")')
        mapfile -t needed <<<"$needed"
        "$venv" "${pip[@]}" install "${needed[@]}"
        cmake/make_wheel.sh "$venv" "$folder" "$work/$version" "$work/rooms"
    fi
    "$venv" "${pip[@]}" download --only-binary :all: --dest "$folder" "$folder"/debulk-*-cp"${version/./}"-*.whl
done
echo "debulk: $folder has $(find "$folder" -name '*.whl' | wc -l) wheels, $(du -sh "$folder" | cut -f1). In a cell: pip install --no-index --find-links $folder debulk"
