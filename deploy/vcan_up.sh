#!/bin/sh
# Make sure that the virtual CAN interface of the bus $1 exists and is up; only `socketcan:NAME` has one. Needs
# CAP_NET_ADMIN, and CAP_SYS_MODULE where the kernel has not loaded vcan yet.
set -eu
interface=${1#socketcan:}
[ "$interface" != "$1" ] || exit 0
if ! ip link show dev "$interface" >/dev/null 2>&1; then
    ip link add dev "$interface" type vcan 2>/dev/null || {
        modprobe vcan
        ip link add dev "$interface" type vcan
    }
fi
ip link set dev "$interface" up
