#include <fmt/format.h>
#include <fmt/ranges.h>

#include "daemon/manual/completion.h"

namespace cellcal::daemon {

namespace {

std::string flags_of(const CommandHelp& command) {
  std::string text;
  for (const OptionHelp& option : command.options)
    for (const std::string& flag : option.flags) text += (text.empty() ? "" : " ") + flag;
  return text;
}

/// A line for each option with a value: its choices, or nothing, which the shell fills with files.
std::string values_of(const CommandHelp& command, const std::string& name) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.value.empty()) continue;
    for (const std::string& flag : option.flags)
      text +=
          fmt::format("    {}:{}) words=\"{}\" ;;\n", name, flag, fmt::join(option.choices, " "));
  }
  return text;
}

}  // namespace

std::string bash_completion(const CommandHelp& program) {
  std::string values = values_of(program, ""), flags, names;
  flags += fmt::format("      '') words=\"{}\" ;;\n", flags_of(program));
  for (const CommandHelp& command : program.commands) {
    values += values_of(command, command.name);
    flags += fmt::format("      {}) words=\"{}\" ;;\n", command.name, flags_of(command));
    names += " " + command.name;
  }
  return fmt::format(R"(# bash completion of {0}, made from the source of its --help
_{0}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} command= words=- i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    case " {1} " in *" ${{COMP_WORDS[i]}} "*) command=${{COMP_WORDS[i]}}; break ;; esac
  done
  case $command:$prev in
{2}  esac
  if [[ $words == - ]]; then
    words=
    if [[ $cur == -* ]]; then
      case $command in
{3}      esac
    elif [[ -z $command ]]; then
      words="{1}"
    fi
  fi
  if [[ -n $words ]]; then
    local IFS=$'\n'
    COMPREPLY=($(IFS=' '; compgen -W "$words" -- "$cur"))
  fi
}}
complete -o default -F _{0} {0}
)",
                     program.name, names.empty() ? "" : names.substr(1), values, flags);
}

}  // namespace cellcal::daemon
