#!/usr/bin/env bash
# Installs what debulk is built with on Debian 12 (and close relatives). Run by the Makefile; safe to run again.
#
#   cmake/install_dependencies.sh PREFIX [LOG]
#
# What apt prints goes into LOG, PREFIX/setup.log by default.
#
# Debian's libpcl-dev depends on VTK, Qt and 650 packages in all. We link five small PCL libraries, so we install
# just their run-time packages and unpack the headers of libpcl-dev and libflann-dev into PREFIX, without their dependencies.
set -euo pipefail

prefix=${1:?usage: install_dependencies.sh PREFIX [LOG]}
log=${2:-$prefix/setup.log}
mkdir -p "$(dirname "$log")"
quietly() { "$(dirname "${BASH_SOURCE[0]}")/quietly.sh" "$log" "$@"; }

build_tools=(build-essential cmake ninja-build pkg-config git ca-certificates python3 python3-dev python3-venv)
libraries=(libeigen3-dev libboost-dev liblz4-dev libpcl-filters1.13 libnlopt-cxx-dev coinor-libipopt-dev
           libgtest-dev libbenchmark-dev)
headers_only=(libpcl-dev libflann-dev)

say() { printf 'debulk: %s\n' "$*"; }
installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q 'install ok installed'; }

if ! command -v apt-get >/dev/null; then
    say "this script knows Debian's apt-get only. Install by hand what it lists (${build_tools[*]} ${libraries[*]})," >&2
    say "put the headers of PCL 1.13 and FLANN under $prefix/usr/include, and run make again." >&2
    exit 1
fi

missing=()
for package in "${build_tools[@]}" "${libraries[@]}"; do
    installed "$package" || missing+=("$package")
done
headers_missing=no
[ -e "$prefix/usr/include/pcl-1.13/pcl/point_cloud.h" ] && [ -e "$prefix/usr/include/flann/flann.hpp" ] || headers_missing=yes

if [ ${#missing[@]} -eq 0 ] && [ "$headers_missing" = no ]; then
    say "all packages are there"
    exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        as_root=(sudo -n)
    elif command -v sudo >/dev/null && [ -t 0 ]; then
        as_root=(sudo)
    else
        say "packages are missing, and this user is neither root nor may use sudo. Ask an administrator to run:" >&2
        say "    apt-get update && apt-get install --no-install-recommends ${missing[*]-}" >&2
        say "then run make again (the PCL headers need no administrator)." >&2
        [ ${#missing[@]} -eq 0 ] || exit 1
    fi
fi

if [ ${#missing[@]} -gt 0 ]; then
    say "installing ${missing[*]}"
    # sudo may have to ask for a password: before its output goes into the log.
    [ ${#as_root[@]} -eq 0 ] || "${as_root[@]}" true
    quietly "${as_root[@]}" apt-get update -q
    for package in "${missing[@]}"; do
        apt-cache show "$package" >/dev/null 2>&1 || {
            say "this system has no package $package: debulk is built on Debian 12, whose PCL is 1.13. Its wheels run on" >&2
            say "newer systems, too: make wheelhouse on a Debian 12 (docs/integration.md)." >&2
            exit 1
        }
    done
    # "Need to get 118 MB of archives." is what decides how long it takes.
    need=$(LC_ALL=C apt-get install --assume-no --no-install-recommends "${missing[@]}" 2>&1 |
        sed -n 's/^Need to get \(.*\) of archives.*/\1/p' || true)
    say "downloading ${need:-the packages}, then unpacking: about two minutes on a fast line"
    quietly "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
        -o APT::Keep-Downloaded-Packages=false "${missing[@]}"
fi

if [ "$headers_missing" = yes ]; then
    say "unpacking the headers of ${headers_only[*]} into $prefix"
    mkdir -p "$prefix"
    downloads=$(mktemp -d)
    trap 'rm -rf "$downloads"' EXIT
    [ "$(id -u)" -ne 0 ] || chown _apt "$downloads" # apt run by root drops to the user _apt for downloads
    download() { (cd "$downloads" && apt-get download -q "${headers_only[@]}"); }
    download >>"$log" 2>&1 || { quietly "${as_root[@]}" apt-get update -q && download >>"$log" 2>&1; } ||
        {
            tail -n 20 "$log" >&2
            say "the headers could not be downloaded. Where apt's lists are old, an administrator has to run" >&2
            say "apt-get update first; then run make again. The whole log: $log" >&2
            exit 1
        }
    for package in "$downloads"/*.deb; do
        dpkg -x "$package" "$prefix"
    done
fi
say "ready"
