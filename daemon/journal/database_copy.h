#pragma once
// Complete copy of a journal's database under another name, which it receives only when it is
// complete, on disk and verified.

#include <filesystem>
#include <memory>
#include <vector>

#include "daemon/journal/chain.h"

namespace cellcal::daemon {

class DatabaseCopy {
 public:
  /// Starts the copy as `to`.part. Throws JournalError if `to` exists.
  DatabaseCopy(Database& from, std::filesystem::path to);
  /// Removes the part file unless it was published.
  ~DatabaseCopy();
  DatabaseCopy(const DatabaseCopy&) = delete;
  DatabaseCopy& operator=(const DatabaseCopy&) = delete;

  /// As PageCopy::step().
  bool step(int pages) { return pages_->step(pages); }
  /// Gives the copy a new outbox source, because the original journal continues to report under its own, whether or not
  /// the copy is opened with a head file.
  void speak_as_another();
  /// Verifies the copy. Throws JournalError if its pages are inconsistent, or its last entry is not
  /// `end`. Returns its damaged sessions, which are those of the journal.
  std::vector<std::int64_t> look_through(const Head& end);
  /// Renames the copy to its name. Throws JournalError if a file of that name exists meanwhile.
  void publish();

 private:
  std::filesystem::path to_, part_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<PageCopy> pages_;
};

}  // namespace cellcal::daemon
