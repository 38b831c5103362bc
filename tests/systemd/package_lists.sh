#!/bin/bash
# package_lists.sh BUILD SOURCE: the installed files equal the packages' lists, each file in one package;
# conffiles, changelog and maintainer scripts are consistent.
set -euo pipefail
build=$1 source=$2
package=$source/systemd/package
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
wrong() { echo "package_lists: $1" >&2; failed=1; }

declare -A component=([cellcal]=programs [libcellcal-dev]=library [cellcal-firmware]=firmware)
grep -q '^AVR_GCC:.*NOTFOUND' "$build/CMakeCache.txt" && unset 'component[cellcal-firmware]'
lacks_arm=$(grep '^ARM_\(GCC\|OBJCOPY\|SIZE\):.*NOTFOUND' "$build/CMakeCache.txt" || true)
for name in "${!component[@]}"; do
  DESTDIR=$work/$name cmake --install "$build" --component "${component[$name]}" --prefix / >/dev/null
  mapfile -t patterns < <(sed -e 's/#.*//' -e '/^ *$/d' "$package/$name.files")
  declare -A met=()
  while read -r file; do
    found=
    for pattern in "${patterns[@]}"; do
      # shellcheck disable=SC2053
      [[ $file == $pattern ]] && found=1 met[$pattern]=1
    done
    [ -n "$found" ] || wrong "$name has $file, of which $name.files knows nothing"
  done < <(cd "$work/$name" && find . ! -type d -printf '%P\n')
  for pattern in "${patterns[@]}"; do
    [ -n "${met[$pattern]:-}" ] || [[ -n $lacks_arm && $pattern == *.uf2 ]] || wrong "$name.files has $pattern, and nothing of it is installed"
  done
  unset met
done
DESTDIR=$work/all cmake --install "$build" --prefix / >/dev/null
diff <(cd "$work/all" && find . ! -type d | sort) \
     <(for name in "${!component[@]}"; do (cd "$work/$name" && find . ! -type d); done | sort) >"$work/diff" ||
  wrong "not each file is in exactly one package: $(cat "$work/diff")"

# READMEs refer to others by the path from the root or from their own folder; those of the tests are in the source alone.
doc=$work/cellcal/share/doc/cellcal
while IFS=: read -r from named; do
  [[ $named == tests/* ]] && continue
  [ -f "$doc/$named" ] || [ -f "$(dirname "$from")/$named" ] || wrong "${from#"$doc"/} refers to $named, which is not installed"
done < <(grep -roE --include='*.md' '[a-z_./]*[a-z_]/[a-z_/-]*README\.md' "$doc" | sort -u)

while read -r conffile; do
  [ -f "$work/cellcal$conffile" ] || wrong "the conffile $conffile is not installed"
done <"$package/control/conffiles"
(cd "$work/cellcal" && find etc -type f -printf '/%p\n') | grep -vxF -f "$package/control/conffiles" &&
  wrong "a file in /etc is no conffile"
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
[[ $(head -1 "$package/changelog") == "cellcal ($version-"* ]] ||
  wrong "the changelog does not begin with version $version"
git -C "$source" rev-parse HEAD >/dev/null 2>&1 &&
  ! grep -qE '^set\(CPACK_DEBIAN_PACKAGE_RELEASE "1\+git[0-9]{14}"\)' "$build/CPackConfig.cmake" &&
  wrong "the release does not rise with the commits"
for script in preinst postinst prerm postrm; do
  sh -n "$package/control/$script" || wrong "$script is no shell script"
  [ -x "$package/control/$script" ] || wrong "$script cannot be run"
done
# Third-party code built into the daemon's page.
python3 - "$source/daemon/web/package.json" "$package/copyright" <<'PY' || wrong "the copyright file lacks what is said above"
import json, sys
copyright = open(sys.argv[2]).read()
stanzas = copyright.split("\n\n")
missing = [name for name in json.load(open(sys.argv[1]))["dependencies"]
           if not any(f"Files: daemon/web/node_modules/{name}/*" in one and "\nCopyright: " in one and "\nLicense: " in one
                      for one in stanzas)]
for name in missing:
    print(f"package_lists: {name}", file=sys.stderr)
sys.exit(bool(missing))
PY
exit $failed
