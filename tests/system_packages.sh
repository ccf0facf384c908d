#!/bin/sh
# Installs what some tests need and pip cannot bring; without root it names what is missing, and those tests skip.
packages=""
need() { command -v "$1" >/dev/null 2>&1 || [ -x "/usr/sbin/$1" ] || [ -x "/sbin/$1" ] || packages="$packages $2"; }
need linux.uml user-mode-linux
need insmod kmod
need ip iproute2
need candump can-utils
need tshark tshark
need mosquitto mosquitto
need mosquitto_sub mosquitto-clients
need openssl openssl
need gcc gcc
need cyclictest rt-tests
need chromium chromium
need systemd-analyze systemd
[ -z "$packages" ] && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "installing system packages for the tests:$packages"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq && apt-get install -y -qq --no-install-recommends $packages >/dev/null && exit 0
    echo "apt could not install:$packages (the tests that need them will skip and say so)"
else
    echo "system packages missing:$packages (the tests that need them will skip; as root: apt-get install$packages)"
fi
exit 0
