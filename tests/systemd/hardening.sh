#!/bin/bash
# hardening.sh BINARY [copies_nothing]: a program or shared library is position-independent, with all relocations
# read-only before its code begins, with stack guards and checked copies of the C library. copies_nothing: it has
# no copy whose size is known to the compiler, and so no checked one.
set -euo pipefail
command -v readelf >/dev/null || exit 77
binary=$1 copies=${2:-} failed=0
missing() { echo "$(basename "$binary"): $1" >&2; failed=1; }
# Complete texts, not a pipe: grep would end readelf at the first match, which counts as a failure.
header=$(readelf -hW "$binary") segments=$(readelf -lW "$binary") dynamic=$(readelf -dW "$binary")
grep -q 'Type: *DYN' <<<"$header" || missing "is not position-independent (link with -pie)"
grep -q TEXTREL <<<"$dynamic" && missing "has relocations in its code (compile with -fPIC)"
grep -q GNU_RELRO <<<"$segments" || missing "has no read-only relocations (-z relro)"
grep -qE 'BIND_NOW|FLAGS_1.*NOW' <<<"$dynamic" || missing "binds late (-z now)"
grep -qE 'GNU_STACK.*RWE' <<<"$segments" && missing "has an executable stack"
symbols=$(readelf --dyn-syms -W "$binary")
grep -q '__stack_chk_fail' <<<"$symbols" || missing "has no guard on the stack (-fstack-protector-strong)"
[[ $copies == copies_nothing ]] || grep -qE '__[a-z]+_chk(@|$| )' <<<"$symbols" || missing "has no checked copies (_FORTIFY_SOURCE=2)"
exit $failed
