#pragma once
// A whole copy of a journal's database under another name. It has that name when it is whole, on
// disk and looked through, and not before.

#include <filesystem>
#include <memory>
#include <vector>

#include "daemon/journal/chain.h"

namespace cellcal::daemon {

class DatabaseCopy {
 public:
  /// Begins it as `to`.part. Throws JournalError where `to` is there already.
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
  /// Reads all of it. Throws JournalError where its pages contradict each other, or it does not end
  /// with this entry. Returns the sessions that are damaged in it, as they are in the journal.
  std::vector<std::int64_t> look_through(const Head& end);
  /// Gives it its name. Throws JournalError where a file has it by now.
  void publish();

 private:
  std::filesystem::path to_, part_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<PageCopy> pages_;
};

}  // namespace cellcal::daemon
