#pragma once
// Cell files that are made over the network: one folder, each by its name.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// Nothing was written, and why.
struct CellNotWritten : std::runtime_error {
  enum class Why {
    kName,      ///< 1 to 64 of A-Z a-z 0-9 _ -
    kUnusable,  ///< what it says contradicts itself or cannot be read
    kThere,     ///< there is such a file, and nobody said that it is to be replaced
    kChanged,   ///< it is another one than was shown
    kMore,  ///< no form shows it as it is (several tools): replaced by a form it would lose something
    kStorage,
  };
  CellNotWritten(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

class CellShelf {
 public:
  explicit CellShelf(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// Names without ".toml", sorted.
  std::vector<std::string> names() const;
  std::filesystem::path file(const std::string& name) const;

  struct Shown {
    std::string text{}, sha256{};     ///< of the file
    std::optional<CellForm> form{};   ///< none: several tools, or no cell file
    std::vector<std::string> kept{};  ///< what it has beyond the form
  };
  /// Any cell file. Throws calib::FileError where it cannot be read.
  static Shown look_at(const std::filesystem::path& file);
  /// None: there is no such file. Throws CellNotWritten (kName), calib::FileError where it cannot be read.
  std::optional<Shown> look(const std::string& name) const;

  /// What contradicts nothing but deserves a look. Throws CellNotWritten (kUnusable).
  static std::vector<std::string> look_through(const CellForm& form);
  /// Whole or not at all. `instead_of`: SHA-256 of the file that it replaces, which is kept beside it as NAME.toml.before; empty: there
  /// is none yet. Throws CellNotWritten.
  /// What the file has beyond the form stays; `from`: of this file instead, which stays as it is.
  std::filesystem::path write(const std::string& name, const CellForm& form,
                              const std::string& instead_of,
                              const std::filesystem::path& from = {}) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace cellcal::daemon
