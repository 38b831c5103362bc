#include <fmt/format.h>
#include <fmt/ranges.h>

#include "daemon/manual/completion.h"

namespace cellcal::daemon {

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

}  // namespace cellcal::daemon
