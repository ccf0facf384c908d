#!/bin/sh
# Installs what some tests need and pip cannot bring. Exit status 1 where something is missing and a skipped test
# would be a hole: as root, which could install it, and in CI (CI=true). Others are told, and those tests skip.
packages=""
need() { command -v "$1" >/dev/null 2>&1 || [ -x "/usr/sbin/$1" ] || [ -x "/sbin/$1" ] || packages="$packages $2"; }
look() {
    packages=""
    need linux.uml user-mode-linux
    need insmod kmod
    need ip iproute2
    need candump can-utils
    need tshark tshark
    need mosquitto mosquitto
    need mosquitto_sub mosquitto-clients
    need openssl openssl
    need gcc gcc
    [ -e /usr/include/stdio.h ] || packages="$packages libc6-dev"
    need cyclictest rt-tests
    # the shell draws the same pages in a fifth of the processor time; not every distribution has it
    if apt-cache show chromium-headless-shell >/dev/null 2>&1; then
        need chromium-headless-shell chromium-headless-shell
    else
        need chromium chromium
    fi
    need systemd-analyze systemd
    [ -z "$packages" ]
}
look && exit 0
root=$([ "$(id -u)" = 0 ] && echo yes)
if [ "$root" ] && command -v apt-get >/dev/null 2>&1; then
    echo "installing system packages for the tests:$packages"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq && { look; apt-get install -y -qq --no-install-recommends $packages >/dev/null; }
    look && exit 0
fi
if [ "$root" ] || [ "${CI:-}" = true ]; then
    echo "system packages missing:$packages (the tests that need them must run as root and in CI: install them)" >&2
    exit 1
fi
echo "system packages missing:$packages (the tests that need them will skip; as root: apt-get install$packages)"
