#pragma once
// Types of a controller's variables, components and functions by name, as far as the given files declare them.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

/// The first comma from `at` on that no bracket encloses; else `end`.
std::size_t next_comma(const std::vector<Token>& tokens, std::size_t at, std::size_t end);

/// Index after the bracket that closes the one at `at`; 0: none does.
std::size_t closed(const std::vector<Token>& tokens, std::size_t at);

class Types {
 public:
  /// Throws FileError for a text that is not KRL.
  explicit Types(const BackupFiles& files);

  /// Type of a variable in upper case ("E6POS"), seen from a line of that module's .src; empty: not declared, or
  /// declared differently by several files. `components`: those after it, as P of XS[2].P.
  std::string of_variable(std::size_t module, int line, const std::string& name,
                          const std::vector<std::string>& components) const;
  std::string of_function(std::size_t module, const std::string& name) const;
  /// The same for the same variable alone, seen from these lines. Behind the modules, counted on, are those that they
  /// may call (ProgramFiles::modules).
  std::string key(std::size_t module, int line, const std::string& name) const;
  /// True for a variable that no other module sees.
  bool own(std::size_t module, int line, const std::string& name) const {
    return key(module, line, name) != name;
  }

 private:
  using Names = std::map<std::string, std::string>;
  struct Module {
    Names variables, functions;
    std::map<int, Names> locals;  ///< by the first line of their routine
  };
  void read_source(const KrlFile& file, Module& module);
  void read_data(const KrlFile& file, Names& names);
  void read_structure(const Line& line);
  bool read_declaration(const Line& line, Names& names);
  static void keep(const std::string& name, const std::string& type, Names& names);

  std::vector<Module> modules_;
  Names globals_, functions_;
  std::map<std::string, Names> structures_;
};

}  // namespace cellcal::daemon::krl
