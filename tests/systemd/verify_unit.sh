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
for unit in cellcald cellcal-check cellcal-fleet cellcal-plant; do
  systemd-analyze security --offline=true --threshold=15 "$dir/$unit.service" >"$dir/security" 2>&1 || {
    tail -5 "$dir/security" >&2
    exit 1
  }
done
