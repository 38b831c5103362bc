# press_tab.zsh PAGES WORDS: types the words into a zsh that has the completion, presses Tab, and prints what
# stands on its screen.
zmodload zsh/zpty
export TERM=dumb
zpty -b shell "zsh -f -i"
zpty -w shell "PS1='> '; fpath=($1 \$fpath); autoload -U compinit; compinit -u -D; cellcal() {}; unsetopt zle_bracketed_paste 2>/dev/null; echo rea''dy"
integer i
seen=
for ((i = 0; i < 500; i++)); do
  zpty -r -t shell part && seen+=$part || sleep 0.01
  [[ $seen == *ready* ]] && break
done
zpty -n -w shell "$2"$'\t'
seen=
integer quiet=0
for ((i = 0; i < 1000 && quiet < 60; i++)); do
  if zpty -r -t shell part; then seen+=$part quiet=0
  else sleep 0.01; [[ -n $seen ]] && ((quiet++)); fi
done
zpty -d shell
print -r -- "$seen"
