#include "daemon/journal/store/file_watch.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

struct stat look_at(const std::filesystem::path& file, const std::filesystem::path& journal) {
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0) return info;
  throw JournalError("journal " + journal.string() + ": " + file.filename().string() +
                     " is gone (" + std::strerror(errno) +
                     ") while this daemon writes to it. Put it back, and restart cellcald");
}

}  // namespace

FileWatch::FileWatch(std::filesystem::path journal, const std::vector<std::filesystem::path>& files)
    : journal_(std::move(journal)) {
  for (const auto& path : files) {
    const struct stat info = look_at(path, journal_);
    files_.push_back({path, info.st_dev, info.st_ino, info.st_size});
  }
}

void FileWatch::look() {
  for (File& file : files_) {
    const struct stat info = look_at(file.path, journal_);
    const bool replaced = info.st_dev != file.device || info.st_ino != file.inode;
    if (replaced || info.st_size < file.size) {
      throw JournalError("journal " + journal_.string() + ": " + file.path.filename().string() +
                         " was " + (replaced ? "replaced by another file" : "cut short") +
                         " while this daemon writes to it. Put the old file back, and restart "
                         "cellcald");
    }
    file.size = info.st_size;
  }
}

}  // namespace cellcal::daemon
