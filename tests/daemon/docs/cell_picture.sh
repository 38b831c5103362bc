#!/bin/bash
# cell_picture.sh SOURCE CELLCAL: daemon/docs/cell.svg equals cellcal's drawing of the demonstration cell.
set -euo pipefail
drawn=$(mktemp)
trap 'rm -f "$drawn"' EXIT
"$1/daemon/docs/pictures" cell "$drawn" "$2"
cmp "$drawn" "$1/daemon/docs/cell.svg" || {
  echo "cell_picture: daemon/docs/cell.svg is out of date; run daemon/docs/pictures" >&2
  exit 1
}
size=$(stat -c %s "$1/daemon/docs/page.png")
[ "$size" -le 150000 ] || { echo "cell_picture: daemon/docs/page.png: $size bytes (limit 150000)" >&2; exit 1; }
