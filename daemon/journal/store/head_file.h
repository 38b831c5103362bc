#pragma once
// Newest entry of the journal, stored outside of it to detect a lost tail.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cellcal::daemon {

struct Head {
  std::int64_t entries = 0;  ///< of the chain
  std::string sum;           ///< of the last one
};

/// Two lines of fixed length, written alternately, so that one is complete after a power failure.
class HeadFile {
 public:
  /// Opens or creates the file. Throws JournalError, which names `journal`.
  HeadFile(std::filesystem::path path, std::filesystem::path journal);
  ~HeadFile();
  HeadFile(const HeadFile&) = delete;
  HeadFile& operator=(const HeadFile&) = delete;

  /// The newer line; nullopt for an empty file. Throws JournalError if no line is complete.
  std::optional<Head> read();
  /// On disk on return. Throws JournalError.
  void write(const Head& head);

 private:
  [[noreturn]] void fail(const std::string& words) const;

  std::filesystem::path path_, journal_;
  int descriptor_ = -1;
  int next_line_ = 0;
};

}  // namespace cellcal::daemon
