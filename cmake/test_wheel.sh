#!/usr/bin/env bash
# Tries a wheelhouse where nothing else is and no network reaches: in a Debian root file system, made by debootstrap,
# that holds only Python.
#
#   cmake/test_wheel.sh WHEELHOUSE ROOT [SUITE [PYTHON]]
#
# ROOT is made if it is not there (two minutes) and kept for the next time; SUITE is its Debian, bookworm (12) or trixie
# (13). Its own python3 is used, or a PYTHON of this machine, whose prefix is mounted there. Needs root, for chroot.
set -euo pipefail

wheelhouse=${1:?usage: test_wheel.sh WHEELHOUSE ROOT [SUITE [PYTHON]]}
root=${2:?usage: test_wheel.sh WHEELHOUSE ROOT [SUITE [PYTHON]]}
suite=${3:-bookworm}
python=${4:-/usr/bin/python3}
most_import_s=0.3

say() { printf 'debulk: %s\n' "$*"; }
die() { say "$*" >&2; exit 1; }

[ "$(id -u)" -eq 0 ] || die "the test of the wheel changes its root file system: run it as root"

if [ ! -e "$root/made" ]; then
    command -v debootstrap >/dev/null || DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends debootstrap
    # The mirror that this machine uses.
    mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
        sed -nE 's/^URIs: *([^ ]*).*/\1/p; s/^deb +(\[[^]]*\] +)?([^ ]+).*/\2/p' | grep -m1 '/debian/\?$') || mirror=
    say "making a clean Debian, $suite, in $root"
    rm -rf "$root"
    mkdir -p "$root"
    debootstrap --variant=minbase --include=python3,python3-venv "$suite" "$root" ${mirror:+"$mirror"} >"$root.log" 2>&1 ||
        { tail -20 "$root.log" >&2; die "debootstrap failed"; }
    touch "$root/made"
fi

# Debian's own Python, or one of this machine: its prefix is then mounted in the root, as nothing else is.
prefix=$("$python" -c 'import sys; print(sys.base_prefix)')
if [ "$prefix" = /usr ]; then
    prefix=
else
    python=$("$python" -c 'import os, sys; print(os.path.realpath(sys.executable))')
    mkdir -p "$root$prefix"
fi
in_root() {
    prefix=$prefix root=$root wheelhouse=$wheelhouse unshare --mount --net sh -euc '
        mount --bind -o ro "$wheelhouse" "$root/wheels"
        [ -z "$prefix" ] || mount --bind -o ro "$prefix" "$root$prefix"
        exec chroot "$root" /usr/bin/env -i PATH=/venv/bin:/usr/bin:/bin LC_ALL=C.UTF-8 HOME=/tmp/try "$@"' in_root "$@"
}

rm -rf "$root/venv" "$root/tmp/try"
mkdir -p "$root/tmp/try" "$root/wheels"
in_root "$python" -m venv /venv
in_root pip install --quiet --disable-pip-version-check --no-index --find-links /wheels debulk

say "$(in_root python --version) in a clean $suite: import, from the wheel's own libraries, in less than $most_import_s s"
in_root python - "$most_import_s" <<'PY'
import sys
import time

import numpy  # not counted

began = time.process_time()
import debulk

seconds = time.process_time() - began
assert seconds < float(sys.argv[1]), f"import debulk took {seconds:.3f} s of a core"
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
assert len(comparison.pockets) >= 14 and comparison.agreement.total > 8, comparison
names = {str(file).rpartition("/licenses/")[2] for file in importlib.metadata.files("debulk") if "/licenses/" in str(file)}
assert {"LICENSE", "third_party_notes.md"} <= names, names
assert sum(name.startswith("bundled/") for name in names) > 5, names
PY
say "the wheel works"
