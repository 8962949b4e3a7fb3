#!/usr/bin/env bash
# Fills a folder with all that a cell without a network installs debulk from: for each Python its wheel, and the wheels
# that this one requires.
#
#   cmake/make_wheelhouse.sh FOLDER BUILD_DIR PYTHON...
#
# Each PYTHON needs its headers (Debian: python3-dev). It gets an environment of its own in BUILD_DIR.
set -euo pipefail

folder=${1:?usage: make_wheelhouse.sh FOLDER BUILD_DIR PYTHON...}
build=${2:?usage: make_wheelhouse.sh FOLDER BUILD_DIR PYTHON...}
shift 2
[ $# -gt 0 ] || { echo 'debulk: no PYTHON was given' >&2; exit 2; }
pip=(-m pip --quiet --disable-pip-version-check)

mkdir -p "$folder"
rm -f "$folder"/*.whl
for python in "$@"; do
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    echo "debulk: a wheel for Python $version (two to four minutes on two cores)"
    "$python" -m venv "$build/venv-$version"
    venv=$build/venv-$version/bin/python
    needed=$("$venv" -c '
import tomllib
p = tomllib.load(open("pyproject.toml", "rb"))
lists = p["build-system"]["requires"], p["project"]["optional-dependencies"]["wheel"], p["project"]["dependencies"]
print(*(one for some in lists for one in some), sep="\n")')
    mapfile -t needed <<<"$needed"
    "$venv" "${pip[@]}" install "${needed[@]}"
    cmake/make_wheel.sh "$venv" "$folder" "$build/wheel-$version"
    "$venv" "${pip[@]}" download --only-binary :all: --dest "$folder" "$folder"/debulk-*-cp"${version/./}"-*.whl
done
echo "debulk: $folder has $(find "$folder" -name '*.whl' | wc -l) wheels, $(du -sh "$folder" | cut -f1). In a cell: pip install --no-index --find-links $folder debulk"
