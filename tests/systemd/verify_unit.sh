#!/bin/sh
# verify_unit.sh SYSTEMD_DIR CELLCALD CELLCAL CELLCAL_FLEET CELLCAL_PLANT: systemd-analyze must not report anything about the units.
# It returns 0 even for unknown keys, so its standard error is checked.
set -eu
command -v systemd-analyze >/dev/null || exit 77
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
# The program is not installed at the unit's path, and need not be.
sed "s#/usr/bin/cellcald#$2#" "$1/cellcald.service" >"$dir/cellcald.service"
sed "s#/usr/bin/cellcal #$3 #" "$1/cellcal-check.service" >"$dir/cellcal-check.service"
sed "s#/usr/bin/cellcal-fleet#$4#" "$1/cellcal-fleet.service" >"$dir/cellcal-fleet.service"
sed "s#/usr/bin/cellcal-plant#$5#" "$1/cellcal-plant.service" >"$dir/cellcal-plant.service"
cp "$1/cellcal-check.timer" "$dir"
systemd-analyze verify --man=no "$dir/cellcald.service" "$dir/cellcal-plant.service" "$dir/cellcal-fleet.service" "$dir/cellcal-check.service" "$dir/cellcal-check.timer" 2>"$dir/words" >&2 || true
if [ -s "$dir/words" ]; then
  cat "$dir/words" >&2
  exit 1
fi
# exposure UNIT TENTHS
exposure() {
  systemd-analyze security --offline=true --threshold="$2" "$dir/$1.service" >"$dir/security" 2>&1 || {
    tail -5 "$dir/security" >&2
    exit 1
  }
}
for unit in cellcal-check cellcal-fleet cellcal-plant; do exposure "$unit" 15; done
exposure cellcald 20
# The daemon's schedule reads the boot's id below /proc/sys and the clock's state by adjtimex.
for denied in '^ProcSubset=pid' '^ProtectClock=yes'; do
  ! grep -q "$denied" "$dir/cellcald.service" || { echo "cellcald.service: $denied keeps the schedule on hold" >&2; exit 1; }
done
# Every night has the timer's time, that of the spring change, too.
for night in 2027-03-27 2027-03-28; do
  next=$(TZ=Europe/Vienna systemd-analyze calendar --base-time="$night 12:00" "$(sed -n 's/^OnCalendar=//p' "$1/cellcal-check.timer")")
  day=$(date -d "$night 1 day" +%F)
  case $next in *"$day"*) ;; *) echo "cellcal-check.timer: does not elapse on $day: $next" >&2; exit 1 ;; esac
done
