#!/bin/bash
# udev_rule.sh SYSTEMD_DIR ADAPTER: result of udev, with all of the machine's own rules, for an adapter
# that is plugged in. The adapter is emulated (umockdev); /dev and /run are folders of a mount
# namespace that ends with the test, so that the machine is not modified.
set -euo pipefail
rules=$1 adapter=$2
[ -n "${IN_NAMESPACE:-}" ] || {
  command -v umockdev-run udevadm unshare >/dev/null || exit 77
  unshare -m true 2>/dev/null || exit 77
  IN_NAMESPACE=1 exec unshare -m "$0" "$@"
}

contact=yes timer= node=
case $adapter in
  ftdi)        tty=ttyUSB0 vendor=0403 product=6001 subsystem=usb-serial timer=16 node=yes ;;
  cp210x)      tty=ttyUSB0 vendor=10c4 product=ea60 subsystem=usb-serial ;;
  ch340)       tty=ttyUSB0 vendor=1a86 product=7523 subsystem=usb-serial ;;
  arduino_uno) tty=ttyACM0 vendor=2341 product=0043 subsystem=usb node=yes ;;
  modem)       tty=ttyACM0 vendor=12d1 product=1506 subsystem=usb contact=no ;;  # nobody's sensor
  *) echo "udev_rule.sh: no adapter $adapter" >&2; exit 2 ;;
esac

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
usb=/devices/pci0000:00/0000:00:14.0/usb1/1-1
parent=$usb/1-1:1.0
[ $subsystem = usb-serial ] && parent=$parent/$tty
{
  printf 'P: %s\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME=bus/usb/001/002\nE: MAJOR=189\nE: MINOR=1\n' $usb
  printf 'A: idVendor=%s\\n\nA: idProduct=%s\\n\nA: serial=A50285BI\\n\n\n' $vendor $product
  printf 'P: %s/1-1:1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceClass=ff\\n\n' $usb
  printf 'A: bInterfaceNumber=00\\n\nA: bInterfaceSubClass=ff\\n\nA: bInterfaceProtocol=ff\\n\n\n'
  if [ $subsystem = usb-serial ]; then
    printf 'P: %s\nE: SUBSYSTEM=usb-serial\nA: port_number=0\\n\n' "$parent"
    [ -z "$timer" ] || printf 'A: latency_timer=%s\\n\n' "$timer"
    printf '\n'
  fi
  printf 'P: %s/tty/%s\nE: SUBSYSTEM=tty\nE: DEVNAME=/dev/%s\nE: MAJOR=188\nE: MINOR=0\nL: device=../../../%s\n' \
    "$parent" $tty $tty "$(basename "$parent")"
} >"$dir/tree"

touch "$dir/null"
mount --bind /dev/null "$dir/null" 2>/dev/null || exit 77
mount -t tmpfs none /dev
touch /dev/null
mount --move "$dir/null" /dev/null
mount -t tmpfs none /run
mkdir -p /run/udev/rules.d
cp "$rules"/*.rules /run/udev/rules.d/
udev_test() { umockdev-run -d "$dir/tree" -- sh -c "udevadm test --action=add /sys$1" >"$dir/told" 2>&1; }

expect() {
  grep -qE "$1" "$dir/told" || { echo "$adapter: udev does not say $1" >&2; grep -v ^Reading "$dir/told" >&2; exit 1; }
}
if [ -n "$node" ]; then
  udev_test $usb
  expect '^DEVLINKS=(.* )?/dev/cellcal-contact-usb( |$)'
  expect ' GROUP 20$|GROUP dialout'
fi
udev_test "$parent/tty/$tty"
expect "^DEVNAME=/dev/$tty"
if [ $contact = no ]; then
  ! grep -q cellcal-contact "$dir/told" || { echo "$adapter is taken for the sensor" >&2; exit 1; }
  exit 0
fi
expect '^DEVLINKS=(.* )?/dev/cellcal-contact( |$)'
expect '^ID_MM_DEVICE_IGNORE=1$'
expect ' GROUP 20$|GROUP dialout'
[ -z "$timer" ] || expect "/device/latency_timer' writing '1'"
! grep 'Failed to write ATTR' "$dir/told" >&2
