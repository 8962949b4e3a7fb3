#!/usr/bin/env bash
# Tries the wheel where nothing else is: a Debian 12 root file system, made by debootstrap, that holds only Python.
#
#   cmake/test_wheel.sh PYTHON WHEEL ROOT
#
# ROOT is made if it is not there (two minutes) and kept for the next time. PYTHON downloads what the wheel requires,
# for the clean Python has no network. Needs root, for chroot.
set -euo pipefail

python=${1:?usage: test_wheel.sh PYTHON WHEEL ROOT}
wheel=${2:?usage: test_wheel.sh PYTHON WHEEL ROOT}
root=${3:?usage: test_wheel.sh PYTHON WHEEL ROOT}
most_import_s=0.3

say() { printf 'debulk: %s\n' "$*"; }
die() { say "$*" >&2; exit 1; }

[ "$(id -u)" -eq 0 ] || die "the test of the wheel changes its root file system: run it as root"

if [ ! -e "$root/made" ]; then
    command -v debootstrap >/dev/null || DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends debootstrap
    # The mirror that this machine uses.
    mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
        sed -nE 's/^URIs: *([^ ]*).*/\1/p; s/^deb +(\[[^]]*\] +)?([^ ]+).*/\2/p' | grep -m1 '/debian/\?$') || mirror=
    say "making a clean Debian 12 in $root"
    rm -rf "$root"
    mkdir -p "$root"
    debootstrap --variant=minbase --include=python3,python3-venv bookworm "$root" ${mirror:+"$mirror"} >"$root.log" 2>&1 ||
        { tail -20 "$root.log" >&2; die "debootstrap failed"; }
    touch "$root/made"
fi

rm -rf "$root/venv" "$root/wheels" "$root/tmp/try"
mkdir -p "$root/wheels" "$root/tmp/try"
cp "$wheel" "$root/wheels/"
"$python" -m pip download --quiet --disable-pip-version-check --only-binary :all: --dest "$root/wheels" "$wheel"

in_root() { chroot "$root" /usr/bin/env -i PATH=/venv/bin:/usr/bin:/bin LC_ALL=C.UTF-8 HOME=/tmp/try "$@"; }

in_root python3 -m venv /venv
in_root pip install --quiet --no-index --find-links /wheels debulk

say "import, from the wheel's own libraries, in less than $most_import_s s"
in_root python - "$most_import_s" <<'PY'
import sys
import time

import numpy  # not counted

began = time.perf_counter()
import debulk

seconds = time.perf_counter() - began
assert seconds < float(sys.argv[1]), f"import debulk took {seconds:.3f} s"
# pydantic, OpenCV and the command line are for those who use them.
assert not {"pydantic", "cv2", "typer", "jinja2"} & set(sys.modules), "import debulk imports too much"
print(f"debulk {debulk.__version__} in {1e3 * seconds:.0f} ms")
PY
linked=$(in_root sh -c 'ldd /venv/lib/python3*/site-packages/debulk/_core*.so')
[ "$(grep -c '/debulk\.libs/' <<<"$linked")" -gt 10 ] || die "the wheel's own libraries are not used: $linked"
foreign=$(grep -vE '/debulk\.libs/|linux-vdso|ld-linux|lib(c|m|stdc\+\+|gcc_s|z)\.so' <<<"$linked") || true
[ -z "$foreign" ] || die "not in the wheel: $foreign"

say "doctor"
in_root debulk doctor >"$root/tmp/try/doctor.log" || { cat "$root/tmp/try/doctor.log" >&2; die "the self-test failed"; }
<"$root/tmp/try/doctor.log" sed -n '/^bundled/,/^licences/p; /^self-test/,$p'

say "a virtual layup, inspected and saved, through the command line"
status=0
in_root debulk demo -o /tmp/try/demo >"$root/tmp/try/demo.log" 2>&1 || status=$?
[ $status -le 1 ] || [ $status -eq 4 ] || { cat "$root/tmp/try/demo.log" >&2; die "debulk demo ended with $status"; }
[ -n "$(find "$root/tmp/try/demo" -name '*.html' -size +10k)" ] || die "debulk demo left no page"

say "the comparison with a debulked layup, and the licences"
in_root python - <<'PY'
import importlib.metadata

import debulk

layup = debulk.scenes.layup(seed=1, pixels=(640, 480))
inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
comparison = inspector.compare(inspector.inspect(layup.scan), layup.debulked().scan)
assert len(comparison.pockets) == 14
names = {str(file).rpartition("/licenses/")[2] for file in importlib.metadata.files("debulk") if "/licenses/" in str(file)}
assert {"LICENSE", "third_party_notes.md"} <= names, names
assert sum(name.startswith("bundled/") for name in names) > 5, names
PY
say "the wheel works in a clean Debian 12"
