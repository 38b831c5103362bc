#pragma once
// Completion of a program's commands and options for three shells. Values without a list of choices complete
// as files.

#include <string>

#include "daemon/manual/command_tree.h"

namespace cellcal::daemon {

std::string bash_completion(const CommandHelp& program);
std::string zsh_completion(const CommandHelp& program);
std::string fish_completion(const CommandHelp& program);

}  // namespace cellcal::daemon
