#pragma once
// What a program's --help says, as plain values: commands, options, their values, words.

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace cellcal::daemon {

struct OptionHelp {
  std::vector<std::string> flags;    ///< "-o", "--output"; empty: it stands by its place
  std::string place;                 ///< name of one that stands by its place, "ID"
  std::string value;                 ///< "TEXT", "INT", ...; empty: it takes none
  std::vector<std::string> choices;  ///< the only values that it takes; empty: any
  std::string range, usual;          ///< "4 - 2000"; its default
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

/// The whole tree below `app`, in the order of --help.
CommandHelp command_tree(const CLI::App& app);

}  // namespace cellcal::daemon
