# Sourced: progress NAME reads ninja's output and prints a line per 5 % of the steps, other lines unchanged.
progress() {
  local line share last=-1
  while IFS= read -r line; do
    if [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\  ]]; then
      share=$((20 * BASH_REMATCH[1] / BASH_REMATCH[2] * 5))
      [ "$share" = "$last" ] || echo "$1: $share % of ${BASH_REMATCH[2]} steps built"
      last=$share
    elif [[ $line != 'ninja: no work'* ]]; then
      echo "$line"
    fi
  done
}
