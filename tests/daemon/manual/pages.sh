#!/bin/bash
# pages.sh CASE CELLCAL PAGES DAEMONS...: the generated manual pages and completions, as read by man and the shells.
set -uo pipefail
case=$1 cellcal=$2 pages=$3
fail() { echo "$case: $1" >&2; exit 1; }
needs() { command -v "$1" >/dev/null || exit 77; }

# completes WORDS EXPECTED...: the words after "cellcal " and the shell's candidates, one per line.
bash_candidates() {
  bash -c 'source "$1"; COMP_WORDS=(cellcal "${@:2}"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _cellcal
           [ ${#COMPREPLY[@]} = 0 ] || printf "%s\n" "${COMPREPLY[@]}"' - "$pages/cellcal.bash" "$@"
}
expect() {
  local got=$1 want=$2
  grep -qxF -e "$want" <<<"$got" || fail "'$want' is not among: $(tr '\n' ' ' <<<"$got")"
}
refuse() {
  grep -qxF -e "$2" <<<"$1" && fail "'$2' is among: $(tr '\n' ' ' <<<"$1")"
  return 0
}

case $case in
  man_has_no_word_to_say)
    needs man
    for page in cellcal.1 cellcald.8 cellcal-fleet.8 cellcal-plant.8; do
      words=$(MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 "$pages/$page" 2>&1 >/dev/null)
      [ -z "$words" ] || fail "$page: $words"
    done ;;
  every_command_is_in_the_page)
    needs man
    # options WORDS...: the long options of that command's help, except --help.
    options() { "$@" --help | grep -oE '^  (-[a-z],)?--[a-z-]+' | grep -oE -e '--[a-z-]+' | grep -vx -e --help || true; }
    commands_of() { "$@" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p'; }
    page_of() { MANWIDTH=200 man -E UTF-8 -l -P cat "$1" | sed 's/.\x08//g'; }
    # part COMMAND: the text after its heading, up to the next one.
    part() { awk -v want="$1" '/^   [^ ]/ { inside = $0 ~ "^ +" want "$"; if (inside) found = 1 } inside; END { exit !found }' <<<"$text"; }
    text=$(page_of "$pages/cellcal.1")
    commands=$(commands_of "$cellcal")
    [ "$(wc -w <<<"$commands")" -ge 12 ] || fail "only these commands: $commands"
    for command in $commands; do
      own=$(part "cellcal $command") || fail "no part for $command"
      for option in $(options "$cellcal" "$command"); do
        grep -qF -e "$option" <<<"$own" || fail "$command $option is not in its part"
      done
      for inner in $(commands_of "$cellcal" "$command"); do
        own=$(part "cellcal $command $inner") || fail "no part for $command $inner"
        for option in $(options "$cellcal" "$command" "$inner"); do
          grep -qF -e "$option" <<<"$own" || fail "$command $inner $option is not in its part"
        done
      done
    done
    shift 3
    for program; do
      text=$(page_of "$pages/$(basename "$program").8")
      for option in $(options "$program"); do
        grep -qF -e "$option" <<<"$text" || fail "$(basename "$program") $option is not in its page"
      done
    done ;;
  bash_completes)
    bash -n "$pages/cellcal.bash" && bash -n "$pages/cellcald.bash" && bash -n "$pages/cellcal-fleet.bash" && bash -n "$pages/cellcal-plant.bash" || fail "bash does not read it"
    got=$(bash_candidates ru); expect "$got" run; refuse "$got" report
    expect "$(bash_candidates run --touch)" --touches
    refuse "$(bash_candidates run --)" --wire
    got=$(bash_candidates kuka-files --wire ''); expect "$got" rsi; expect "$got" eki
    expect "$(bash_candidates fleet '')" overdue
    expect "$(bash_candidates fleet compare --jo)" --joint
    [ -z "$(bash_candidates run '')" ] || fail "commands are offered after a command that has none"
    [ -z "$(bash_candidates run --cell '')" ] || fail "a file is not left to the shell" ;;
  zsh_completes)
    needs zsh
    zsh -n "$pages/_cellcal" && zsh -n "$pages/_cellcald" && zsh -n "$pages/_cellcal-fleet" && zsh -n "$pages/_cellcal-plant" || fail "zsh does not read it"
    # A terminal of its own, for pressing the key.
    got=$(zsh -f "$(dirname "$0")/press_tab.zsh" "$pages" 'cellcal ru')
    [[ $got == *"cellcal run "* ]] || fail "after 'cellcal ru<Tab>': $got"
    got=$(zsh -f "$(dirname "$0")/press_tab.zsh" "$pages" 'cellcal kuka-files --wire r')
    [[ $got == *"--wire rsi "* ]] || fail "after '--wire r<Tab>': $got"
    got=$(zsh -f "$(dirname "$0")/press_tab.zsh" "$pages" 'cellcal run --touch')
    [[ $got == *"run --touches "* ]] || fail "after 'run --touch<Tab>': $got"
    got=$(zsh -f "$(dirname "$0")/press_tab.zsh" "$pages" 'cellcal fleet overd')
    [[ $got == *"fleet overdue "* ]] || fail "after 'fleet overd<Tab>': $got"
    got=$(zsh -f "$(dirname "$0")/press_tab.zsh" "$pages" 'cellcal fleet compare --jo')
    [[ $got == *"compare --joint "* ]] || fail "after 'fleet compare --jo<Tab>': $got" ;;
  fish_completes)
    needs fish
    fish --no-execute "$pages/cellcal.fish" "$pages/cellcald.fish" || fail "fish does not read it"
    candidates() { HOME=$(mktemp -d) fish --no-config -c "source $pages/cellcal.fish; complete -C '$1'" | cut -f1; }
    got=$(candidates 'cellcal ru'); expect "$got" run; refuse "$got" report
    expect "$(candidates 'cellcal run --touch')" --touches
    got=$(candidates 'cellcal kuka-files --wire '); expect "$got" rsi; expect "$got" eki
    got=$(candidates 'cellcal run --'); refuse "$got" --wire
    got=$(candidates 'cellcal fleet o'); expect "$got" overdue; refuse "$(candidates 'cellcal run o')" overdue
    expect "$(candidates 'cellcal fleet compare --jo')" --joint ;;
  *) fail "no such case" ;;
esac
