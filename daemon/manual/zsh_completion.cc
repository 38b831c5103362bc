#include <fmt/format.h>
#include <fmt/ranges.h>

#include "daemon/manual/completion.h"

namespace cellcal::daemon {

namespace {

/// Within single quotes, and within the brackets of _arguments.
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

/// _arguments' word for each flag: '--cell=[Cell file]:TEXT:_files'.
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
