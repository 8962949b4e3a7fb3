#!/usr/bin/env bash
# Installs the C++ package of a build and builds the example on it, outside the tree: cmake/test_cpp_package.sh BUILD_FOLDER
set -euo pipefail
build=$(realpath "$1")
example=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../docs/examples/cpp")
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT

{ cmake --install "$build" --prefix "$away/debulk" --component cpp &&
    cmake -S "$example" -B "$away/build" -G Ninja -DCMAKE_PREFIX_PATH="$away/debulk" -DCMAKE_BUILD_TYPE=Release &&
    cmake --build "$away/build"; } >"$away/log" 2>&1 || { cat "$away/log" >&2; exit 1; }

says() { # HEIGHT_MM VERDICT
    "$away/build/one_pocket" "$1" | tee "$away/said"
    grep -q "^$2: " "$away/said" || { echo "debulk: the C++ example does not say $2 of a pocket $1 mm high" >&2; exit 1; }
}
says 2 cease
says 8 crease
