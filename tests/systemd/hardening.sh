#!/bin/bash
# hardening.sh BINARY: position-independent, all of its relocations read-only before main() begins, guards
# on the stack, checked copies of the C library.
set -euo pipefail
command -v readelf >/dev/null || exit 77
binary=$1 failed=0
missing() { echo "$(basename "$binary"): $1" >&2; failed=1; }
readelf -hW "$binary" | grep -q 'Type: *DYN' || missing "is not position-independent (link with -pie)"
readelf -lW "$binary" | grep -q GNU_RELRO || missing "has no read-only relocations (-z relro)"
readelf -dW "$binary" | grep -qE 'BIND_NOW|FLAGS_1.*NOW' || missing "binds late (-z now)"
readelf -lW "$binary" | grep 'GNU_STACK' | grep -q 'RWE' && missing "has an executable stack"
symbols=$(readelf --dyn-syms -W "$binary")
grep -q '__stack_chk_fail' <<<"$symbols" || missing "has no guard on the stack (-fstack-protector-strong)"
grep -qE '__[a-z]+_chk(@|$| )' <<<"$symbols" || missing "has no checked copies (_FORTIFY_SOURCE=2)"
exit $failed
