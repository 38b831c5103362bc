# Sourced: a Debian root of its own for tests of packages. Requires root, debootstrap and a Debian mirror; if one
# is missing the script exits with 77 and reports it.
base=${CELLCAL_ROOT_CACHE:-build/package/root.tar}

skip() { echo "skipped: $1"; exit 77; }
fail() { echo "FAILED: $1" >&2; exit 1; }
step() { echo "== $1"; }

[ "$(id -u)" = 0 ] || skip "it takes root to make a root of its own (sudo $0)"
command -v debootstrap >/dev/null || skip "debootstrap is missing (tests/install package)"
ls build/package/packages/cellcal_*.deb >/dev/null 2>&1 ||
  skip "there are no packages: build them first with systemd/package/build"

# make_root DIR: a fresh Debian 12 with systemd; archived, so that the next one takes seconds.
make_root() {
  mkdir -p "$(dirname "$base")"
  if [ ! -f "$base" ]; then
    step "debootstrap, once, into $base"
    local fresh
    fresh=$(mktemp -d)
    chmod 755 "$fresh"
    debootstrap --variant=minbase --include=systemd,udev,dbus,init-system-helpers,procps bookworm "$fresh" \
      ${CELLCAL_MIRROR:+"$CELLCAL_MIRROR"} >"$base.log" 2>&1 || { rm -rf "$fresh"; skip "debootstrap: $(tail -1 "$base.log")"; }
    chroot "$fresh" apt-get update -qq
    chroot "$fresh" apt-get install -y -qq --no-install-recommends --download-only \
      $(dpkg-deb -f build/package/packages/cellcal_*.deb Depends | sed 's/([^)]*)//g; s/|[^,]*//g; s/,/ /g') >/dev/null
    tar -C "$fresh" -cf "$base" .
    rm -rf "$fresh"
  fi
  mkdir -p "$1"
  tar -C "$1" -xf "$base"
  chmod 755 "$1"
  cp --remove-destination /etc/resolv.conf "$1/etc/resolv.conf"
}

# packed_as VERSION COMMAND: the package with another version, after COMMAND modified its tree in $tree.
packed_as() {
  local tree=$work/repacked
  rm -rf "$tree"
  dpkg-deb -R build/package/packages/cellcal_*.deb "$tree"
  sed -i "s/^Version: .*/Version: $1/" "$tree/DEBIAN/control"
  tree=$tree bash -c "$2"
  sed -i '/ etc\//d' "$tree/DEBIAN/md5sums"  # dpkg keeps those of conffiles itself
  dpkg-deb -b "$tree" "$root/var/tmp/cellcal_$1.deb" >/dev/null
}
