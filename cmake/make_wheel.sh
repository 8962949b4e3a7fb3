#!/usr/bin/env bash
# Makes a wheel that needs nothing but Python and glibc: the shared libraries it uses lie in it, with their licences.
#
#   cmake/make_wheel.sh PYTHON FOLDER BUILD_DIR [ROOMS]
#
# PYTHON has the packages of the extra "wheel" and of the build. The wheel is left in FOLDER, in place of an earlier one
# for the same Python. With ROOMS, a prefix where the C++ package of this source is installed, only the bindings compile.
set -euo pipefail

python=${1:?usage: make_wheel.sh PYTHON FOLDER BUILD_DIR [ROOMS]}
folder=${2:?usage: make_wheel.sh PYTHON FOLDER BUILD_DIR [ROOMS]}
build=${3:?usage: make_wheel.sh PYTHON FOLDER BUILD_DIR [ROOMS]}
rooms=${4:-}
most_bytes=$((20 * 1000 * 1000))

say() { printf 'debulk: %s\n' "$*"; }
die() { say "$*" >&2; exit 1; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$python" -m pip wheel --quiet --disable-pip-version-check --no-build-isolation --no-deps \
    --config-settings=build-dir="$build" ${rooms:+--config-settings=cmake.define.DEBULK_ROOMS="$rooms"} --wheel-dir "$work/raw" .
PATH="$(cd "$(dirname "$python")" && pwd):$PATH" "$python" -m auditwheel repair --wheel-dir "$work/repaired" "$work"/raw/*.whl >"$work/repair.log" 2>&1 ||
    { cat "$work/repair.log" >&2; die "auditwheel failed"; }
"$python" -m wheel unpack --dest "$work/open" "$work"/repaired/*.whl >/dev/null
opened=$(echo "$work"/open/*)
licences=$(echo "$opened"/*.dist-info/licenses)

# A library's licence is its Debian package's. auditwheel puts a hash into the names of what it bundles; the raw wheel
# tells which files of this system they were.
"$python" -m zipfile -e "$work"/raw/*.whl "$work/linked"
linked=$(ldd "$work"/linked/debulk/_core*.so | awk '$3 ~ /^\// {print $3}' | xargs -n1 readlink -f | sort -u)
bundled=$(ls "$opened/debulk.libs" | sed -E 's/-[0-9a-f]{8}(\.|$)/\1/' | sort)
mkdir -p "$licences/bundled"
for name in $bundled; do
    path=$(grep -F "/$name" <<<"$linked" | head -1) || die "no linked library is called $name"
    package=$(dpkg -S "$path" 2>/dev/null || dpkg -S "${path#/usr}") || die "no Debian package holds $path"
    package=${package%%:*}
    cp "/usr/share/doc/$package/copyright" "$licences/bundled/$package.txt"
done
# Debian's copyright files point to these instead of quoting them.
for text in $(grep -rhoE '/usr/share/common-licenses/[A-Za-z0-9.-]*[A-Za-z0-9]' "$licences/bundled" | sort -u); do
    [ -e "$text" ] && cp -L "$text" "$licences/bundled/common-$(basename "$text").txt"
done

# What the wheel consists of, for those who look for a library's faults (PEP 770).
sboms=$(echo "$opened"/*.dist-info)/sboms
mkdir -p "$sboms"
PYTHONPATH=$opened "$python" -B cmake/bill.py >"$sboms/debulk.cdx.json"

"$python" -m wheel pack --dest-dir "$work" "$opened" >/dev/null
wheel=$(echo "$work"/*.whl)
tag=$(cut -d- -f3 <<<"$(basename "$wheel")")
mkdir -p "$folder"
rm -f "$folder"/debulk-*-"$tag"-*.whl
mv "$wheel" "$folder/"
wheel=$folder/$(basename "$wheel")
bytes=$(stat -c %s "$wheel")
[[ $wheel == *manylinux_2_*_x86_64.whl ]] || die "$wheel: expected a manylinux tag"
[ "$bytes" -lt $most_bytes ] || die "$wheel: $bytes bytes, expected fewer than $most_bytes"
say "$wheel: $bytes bytes, $(wc -w <<<"$bundled") libraries bundled, licences of $(ls "$licences/bundled" | grep -vc '^common-') packages"
