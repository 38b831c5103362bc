#include "daemon/manual/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cellcal::daemon {

namespace {

std::string flags_of(const CommandHelp& command) {
  std::string text;
  for (const OptionHelp& option : command.options)
    for (const std::string& flag : option.flags) text += (text.empty() ? "" : " ") + flag;
  return text;
}

/// One line per option with a value: its choices, or none, in which case the shell completes files.
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

namespace {

std::string quoted(const std::string& words) {
  std::string text = "'";
  for (const char c : words) {
    if (c == '\'' || c == '\\') text += '\\';
    text += c;
  }
  return text + "'";
}

std::string flag_words(const OptionHelp& option) {
  std::string text;
  for (const std::string& flag : option.flags)
    text += flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
  return text;
}

std::string value_words(const OptionHelp& option) {
  if (option.value.empty()) return {};
  if (option.choices.empty()) return " -r -F";
  return fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
}

std::string options_of(const std::string& program, const CommandHelp& command,
                       const std::string& when) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.flags.empty()) continue;
    text += fmt::format("complete -c {}{}{}{} -d {}\n", program, when, flag_words(option),
                        value_words(option), quoted(option.words));
  }
  return text;
}

}  // namespace

std::string fish_completion(const CommandHelp& program) {
  std::string text =
      fmt::format("# fish completion of {}, made from the source of its --help\n", program.name);
  const bool commands = !program.commands.empty();
  text += options_of(program.name, program, commands ? " -n __fish_use_subcommand" : "");
  for (const CommandHelp& command : program.commands) {
    text += fmt::format("complete -c {} -n __fish_use_subcommand -f -a {} -d {}\n", program.name,
                        command.name, quoted(command.words));
    text += options_of(program.name, command,
                       fmt::format(" -n '__fish_seen_subcommand_from {}'", command.name));
  }
  return text;
}

namespace {

/// Quoted for single quotes and for the brackets of _arguments.
std::string quoted(const std::string& words, const std::string& special) {
  std::string text;
  for (const char c : words) {
    if (c == '\'')
      text += "'\\''";
    else if (special.find(c) != std::string::npos)
      text += std::string("\\") + c;
    else
      text += c;
  }
  return text;
}

std::string value_of(const OptionHelp& option) {
  if (option.value.empty()) return {};
  if (option.choices.empty()) return fmt::format(":{}:_files", option.value);
  return fmt::format(":{}:({})", option.value, fmt::join(option.choices, " "));
}

/// Specification of _arguments for each flag: '--cell=[Cell file]:TEXT:_files'.
std::string arguments_of(const CommandHelp& command, const std::string& indent) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    const std::string words = quoted(option.words, "\\[]");
    if (option.flags.empty())
      text += fmt::format(" \\\n{}'::{}:_files'", indent, quoted(option.place, ":\\"));
    for (const std::string& flag : option.flags)
      text += fmt::format(" \\\n{}'{}[{}]{}'", indent, flag, words, value_of(option));
  }
  return text;
}

}  // namespace

std::string zsh_completion(const CommandHelp& program) {
  std::string text = fmt::format(
      "#compdef {0}\n# zsh completion of {0}, made from the source of its --help\n_{0}() {{\n",
      program.name);
  if (program.commands.empty())
    return text + fmt::format("  _arguments{}\n}}\n_{} \"$@\"\n", arguments_of(program, "    "),
                              program.name);
  std::string names, commands;
  for (const CommandHelp& command : program.commands) {
    names += fmt::format("        '{}:{}'\n", command.name, quoted(command.words, "\\"));
    commands += fmt::format("        {}) _arguments{} ;;\n", command.name,
                            arguments_of(command, "          "));
  }
  return text + fmt::format(R"(  local state line
  typeset -A opt_args
  _arguments -C{1} \
    '1:command:->command' '*::argument:->argument'
  case $state in
    command)
      local -a commands
      commands=(
{2}      )
      _describe -t commands command commands ;;
    argument)
      case $line[1] in
{3}      esac ;;
  esac
}}
_{0} "$@"
)",
                            program.name, arguments_of(program, "    "), names, commands);
}

}  // namespace cellcal::daemon
