#include "daemon/manual/command_tree.h"

#include <CLI/CLI.hpp>
#include <sstream>

namespace cellcal::daemon {

namespace {

/// Text between the first `open` and the following `close`; may be empty.
std::string between(const std::string& text, char open, char close) {
  const std::size_t from = text.find(open);
  const std::size_t to = text.find(close, from);
  if (from == std::string::npos || to == std::string::npos) return {};
  return text.substr(from + 1, to - from - 1);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

/// CLI11 formats a value's type and validators as "TEXT:{rsi,eki}" and "INT:INT in [4 - 2000]".
OptionHelp option_help(const CLI::Option& option) {
  OptionHelp help;
  for (const std::string& name : option.get_snames()) help.flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) help.flags.push_back("--" + name);
  if (help.flags.empty()) help.place = option.get_name(true);
  const std::string type = option.get_type_name();
  if (option.get_type_size() != 0) help.value = type.substr(0, type.find(':'));
  help.choices = split(between(type, '{', '}'), ',');
  help.range = between(type, '[', ']');
  help.usual = option.get_default_str();
  help.words = option.get_description();
  help.required = option.get_required();
  return help;
}

/// Footer: remarks, wrapped for a terminal, then "Example: " with one command line per line.
void parse_footer(const std::string& footer, CommandHelp& help) {
  const std::string mark = "Example: ";
  bool in_examples = false;
  for (std::string line : split(footer, '\n')) {
    if (line.starts_with(mark)) {
      in_examples = true;
      line.erase(0, mark.size());
    }
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    line.erase(0, begin);
    const bool command = line.starts_with("cellcal");
    if (in_examples && command)
      help.examples.push_back(line);
    else
      help.remarks += (help.remarks.empty() ? "" : " ") + line;
  }
}

}  // namespace

CommandHelp command_tree(const CLI::App& app) {
  CommandHelp help{app.get_name(), app.get_description(), {}, {}, {}, {}};
  parse_footer(app.get_footer(), help);
  for (const CLI::Option* option : app.get_options()) help.options.push_back(option_help(*option));
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    help.commands.push_back(command_tree(*command));
  return help;
}

}  // namespace cellcal::daemon
