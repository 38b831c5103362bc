#pragma once
// Manual page of a program's help, in roff's man macros.

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cellcal::daemon {

// Content of a program's --help as plain values: commands, options, values, texts.

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

struct ManPage {
  CommandHelp help;
  int section = 1;
  std::string version;
  std::string_view more;              ///< roff: exit statuses, files, signals
  std::vector<std::string> see_also;  ///< "cellcald(8)"
};

std::string man_page(const ManPage& page);

// Completion of a program's commands and options for three shells. Values without a list of choices complete
// as files.

std::string bash_completion(const CommandHelp& program);
std::string zsh_completion(const CommandHelp& program);
std::string fish_completion(const CommandHelp& program);

}  // namespace cellcal::daemon
