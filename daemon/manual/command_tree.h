#pragma once
// Content of a program's --help as plain values: commands, options, values, texts.

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace cellcal::daemon {

struct OptionHelp {
  std::vector<std::string> flags;    ///< "-o", "--output"; empty: a positional argument
  std::string place;                 ///< name of a positional argument, "ID"
  std::string value;                 ///< "TEXT", "INT", ...; empty: a flag
  std::vector<std::string> choices;  ///< the only permitted values; empty: any
  std::string range, usual;          ///< "4 - 2000"; default value
  std::string words;
  bool required = false;
};

struct CommandHelp {
  std::string name, words;
  std::string remarks;                ///< below the options, unwrapped
  std::vector<std::string> examples;  ///< one command line each
  std::vector<OptionHelp> options;
  std::vector<CommandHelp> commands;
};

/// The whole command tree of `app`, in the order of --help.
CommandHelp command_tree(const CLI::App& app);

}  // namespace cellcal::daemon
