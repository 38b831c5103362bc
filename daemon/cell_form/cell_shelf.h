#pragma once
// Folder of cell files created over the network, by name.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// Nothing was written; the reason.
struct CellNotWritten : std::runtime_error {
  enum class Why {
    kName,      ///< 1 to 64 of A-Z a-z 0-9 _ -
    kUnusable,  ///< contradictory or unreadable content
    kThere,     ///< the file exists, and replacing it was not confirmed
    kChanged,   ///< the file has changed since it was displayed
    kMore,      ///< not representable by a form (several tools): replacing it would lose content
    kStorage,
  };
  CellNotWritten(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

class CellFileStore {
 public:
  explicit CellFileStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// Names without ".toml", sorted.
  std::vector<std::string> names() const;
  std::filesystem::path file(const std::string& name) const;

  struct Shown {
    std::string text{}, sha256{};     ///< of the file
    std::optional<CellForm> form{};   ///< none: several tools, or not a cell file
    std::vector<std::string> kept{};  ///< content beyond the form
  };
  /// Any cell file. Throws calib::FileError where it cannot be read.
  static Shown look_at(const std::filesystem::path& file);
  /// None: the file does not exist. Throws CellNotWritten (kName), calib::FileError where it cannot be read.
  std::optional<Shown> look(const std::string& name) const;

  /// Non-fatal findings. Throws CellNotWritten (kUnusable).
  static std::vector<std::string> look_through(const CellForm& form);
  /// Writes atomically. `instead_of`: SHA-256 of the file to replace, which is kept as NAME.toml.before;
  /// empty: a new file. Content beyond the form is kept, from the replaced file or from `from`, which is left
  /// unchanged. Throws CellNotWritten.
  std::filesystem::path write(const std::string& name, const CellForm& form,
                              const std::string& instead_of,
                              const std::filesystem::path& from = {}) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace cellcal::daemon
