#include "daemon/journal/database_copy.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

std::filesystem::path part_of(std::filesystem::path path) { return path += ".part"; }

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& words) {
  throw JournalError("copy " + file.string() + ": " + words);
}

void refuse_existing(const std::filesystem::path& file) {
  std::error_code code;
  if (std::filesystem::exists(std::filesystem::symlink_status(file, code)))
    fail(file, "there is a file of this name already. Name another, or remove it");
}

void sync(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int code = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced) fail(path, std::string("cannot be written to disk (") + std::strerror(code) + ")");
}

void remove_with_logs(const std::filesystem::path& part) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;  // the first error is reported
    std::filesystem::remove(part.string() + suffix, ignored);
  }
}

}  // namespace

DatabaseCopy::DatabaseCopy(Database& from, std::filesystem::path to)
    : to_(std::move(to)), part_(part_of(to_)) {
  refuse_existing(to_);
  remove_with_logs(part_);  // of a backup that was killed
  database_ = std::make_unique<Database>(part_);
  try {
    // Synchronized once, when complete.
    database_->execute("PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY");
    pages_ = std::make_unique<PageCopy>(from, *database_);
  } catch (...) {
    remove_with_logs(part_);
    throw;
  }
}

DatabaseCopy::~DatabaseCopy() {
  pages_.reset();
  if (!database_) return;
  database_.reset();
  remove_with_logs(part_);
}

std::vector<std::int64_t> DatabaseCopy::look_through(const Head& end) {
  pages_.reset();
  // A single file that can be read without its log.
  database_->execute("PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = DELETE");
  if (const std::string found = database_->text("PRAGMA quick_check(1)"); found != "ok")
    fail(to_, "damaged while it was written (" + found + "). Check the disk");
  if (end.entries == 0) return {};
  const Head copied = walk_chain(*database_).end;
  if (copied.entries != end.entries || copied.sum != end.sum)
    fail(to_, "does not end where the journal does. Check the disk");
  return damaged_sessions(*database_);
}

void DatabaseCopy::speak_as_another() {
  pages_.reset();
  Transaction transaction(*database_);
  begin_source(*database_);
  transaction.commit();
}

void DatabaseCopy::publish() {
  database_->execute("PRAGMA locking_mode = NORMAL");
  database_.reset();
  const auto give_up = [&](const std::string& words) {
    remove_with_logs(part_);
    fail(to_, words);
  };
  sync(part_, O_RDONLY);
  if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, to_.c_str(), RENAME_NOREPLACE) != 0) {
    if (errno == EEXIST) give_up("there is a file of this name already. Name another");
    if (errno != EINVAL) give_up(std::string("cannot get its name (") + std::strerror(errno) + ")");
    refuse_existing(to_);  // this file system does not support an atomic rename without replacement
    std::filesystem::rename(part_, to_);
  }
  const std::filesystem::path parent = to_.parent_path();
  sync(parent.empty() ? "." : parent, O_RDONLY | O_DIRECTORY);
}

}  // namespace cellcal::daemon
