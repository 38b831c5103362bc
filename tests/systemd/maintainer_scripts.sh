#!/bin/bash
# maintainer_scripts.sh SOURCE: effects of the package's scripts on the service, called as by dpkg, with
# programs that record their calls in place of the system's.
set -euo pipefail
control=$1/systemd/package/control
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/bin" "$work/root/run/systemd/system"
for program in deb-systemd-invoke deb-systemd-helper systemctl systemd-sysusers udevadm cellcal cellcald; do
  cat >"$work/bin/$program" <<'SH'
#!/bin/sh
name=${0##*/}
echo "$name $*" >>"$CALLS"
case "$name $*" in
  'systemctl --quiet is-active '*) [ "$SERVICE" != stopped ] ;;
  'cellcald --check') [ "$SERVICE" != refused ] || { echo 'cellcald.toml: unknown key'; exit 2; } ;;
  'cellcal status --json') [ "$SERVICE" = running ] && echo '{"running":true}' || echo '{"running":false}' ;;
esac
SH
  chmod 755 "$work/bin/$program"
done
failed=0
# call SERVICE SCRIPT ARGUMENTS...: SERVICE is stopped, idle, or running a session.
call() {
  CALLS=$work/calls SERVICE=$1 DPKG_ROOT=$work/root PATH=$work/bin:/usr/bin:/bin sh "$control/$2" "${@:3}" >"$work/out"
}
# service_is WHAT: started, restarted or left; then resets the recorded calls.
service_is() {
  local what=left
  grep -qx 'deb-systemd-invoke start cellcald.service' "$work/calls" && what=started
  grep -qE 'deb-systemd-(invoke|helper) (start|enable) cellcal-fleet' "$work/calls" &&
    { echo "maintainer_scripts: $2: the collector is started without being asked for" >&2; failed=1; }
  grep -qx 'deb-systemd-invoke restart cellcald.service' "$work/calls" && what=restarted
  [ "$what" = "$1" ] || { echo "maintainer_scripts: $2: the service is $what, not $1" >&2; failed=1; }
  rm "$work/calls"
}

call stopped preinst install
call stopped postinst configure ''
service_is started "installed for the first time"

call idle prerm remove
grep -qx 'deb-systemd-invoke stop cellcal-check.timer cellcal-fleet.service cellcald.service' "$work/calls" || { echo "maintainer_scripts: removing does not stop it" >&2; failed=1; }
call stopped postrm remove
rm "$work/calls"
call stopped preinst install 0.1.0-1
call stopped postinst configure 0.1.0-1
service_is started "installed again after it was removed"

call idle preinst upgrade 0.1.0-1
call idle postinst configure 0.1.0-1
service_is restarted "upgraded while idle"
call stopped preinst upgrade 0.1.0-1
call stopped postinst configure 0.1.0-1
service_is left "upgraded while somebody has stopped it"
call running preinst upgrade 0.1.0-1
call running postinst configure 0.1.0-1
service_is left "upgraded in mid-session"
grep -q 'NOT restarted' "$work/out" || { echo "maintainer_scripts: it does not say so" >&2; failed=1; }

call refused preinst upgrade 0.1.0-1
call refused postinst configure 0.1.0-1
service_is left "upgraded while idle, with a configuration that the new version refuses"
grep -q 'unknown key' "$work/out" || { echo "maintainer_scripts: it does not name the fault" >&2; failed=1; }

mkdir -p "$work/root/etc/systemd/system/timers.target.wants"
ln -s /lib/systemd/system/cellcal-check.timer "$work/root/etc/systemd/system/timers.target.wants/"
call stopped postrm purge
[ ! -L "$work/root/etc/systemd/system/timers.target.wants/cellcal-check.timer" ] ||
  { echo "maintainer_scripts: purging leaves the link of an enabled unit" >&2; failed=1; }
rm -f "$work/calls"

call stopped postinst abort-remove in-favour other 1
service_is started "not removed after all"

call stopped preinst install 0.1.0-1
call stopped postrm abort-install 0.1.0-1
[ ! -e "$work/root/run/cellcald.installed" ] || { echo "maintainer_scripts: left behind" >&2; failed=1; }
exit $failed
