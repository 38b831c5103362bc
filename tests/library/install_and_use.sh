#!/bin/bash
# install_and_use.sh BUILD SOURCE: use by an external programmer. Installs into a folder, moves that folder
# elsewhere, builds the seven examples against it, outside of the source, and checks their output.
set -euo pipefail
build=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "install_and_use: $1" >&2; exit 1; }

cmake --install "$build" --prefix "$work/first" >/dev/null
mv "$work/first" "$work/prefix"
grep -rlF -e "$source/" -e "$work/first" "$work/prefix" && fail "the installation holds absolute paths"
cp -r "$source/calib/examples" "$work/examples"
# Every installed header finds all its includes.
(cd "$work/prefix/include/cellcal" && find . -name '*.h' | sed 's/.*/#include "&"/') >"$work/examples/all.cc"
echo 'add_library(every_header OBJECT all.cc)
target_link_libraries(every_header PRIVATE cellcal::plan)' >>"$work/examples/CMakeLists.txt"

cmake -S "$work/examples" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_BUILD_TYPE=Debug \
      -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
grep -qE 'Werror|ompl|ceres|spdlog' "$work/build/compile_commands.json" &&
  fail "flags or folders of the build reach the program"
cmake --build "$work/build" -j2 >"$work/log" 2>&1 || { cat "$work/log"; fail "an example does not build"; }

cd "$work/build"
holds() { grep -qE "$2" <<<"$1" || fail "'$2' is not in: $1"; }
cell=$work/examples/cell.toml touches=$work/examples/touches.csv
holds "$(./02_identify_from_a_csv "$cell" "$touches" now.json)" 'published yes'
holds "$(./01_predict_a_pose now.json 0 -90 90 0 30 0)" 'calibrated .* mm, within 0\.[0-9]+ mm'
holds "$(./07_correct_a_pose now.json 0 -90 90 0 30 0)" 'corrected .* deg, forward [0-9.e-]+ mm off'
holds "$(./03_read_the_bound now.json)" 'A2\.theta  -?[0-9.e-]+ \+- [0-9.e-]+ deg \(k=2\)'
head -61 "$touches" >some.csv  # the names of the columns and 60 touches
./02_identify_from_a_csv "$cell" some.csv then.json >/dev/null || [ $? = 3 ]
holds "$(./04_compare_two_calibrations then.json now.json "$touches")" 'apart on average'
holds "$(./05_plan_touches "$cell" 12)" '12 touches promise'
holds "$(./06_a_robot_of_your_own)" 'A2\.theta  0\.(19|20)'
