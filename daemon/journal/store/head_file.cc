#include "daemon/journal/store/head_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

constexpr mode_t kMode = 0640;
constexpr std::size_t kNumber = 19, kSum = 64, kCheck = 16;
constexpr std::string_view kFormat = "cellcal.journal-head/1 ";
constexpr std::size_t kLine = kFormat.size() + kNumber + 1 + kSum + 1 + kCheck + 1;

std::string line_of(const Head& head) {
  const std::string words = fmt::format("{}{:019} {} ", kFormat, head.entries, head.sum);
  return words + calib::sha256(words).substr(0, kCheck) + "\n";
}

/// nullopt for an incomplete line.
std::optional<Head> head_of(std::string_view line) {
  if (line.size() != kLine) return std::nullopt;
  Head head;
  const char* number = line.data() + kFormat.size();
  if (std::from_chars(number, number + kNumber, head.entries).ec != std::errc()) {
    return std::nullopt;
  }
  head.sum = line.substr(kFormat.size() + kNumber + 1, kSum);
  if (line_of(head) != line) return std::nullopt;
  return head;
}

}  // namespace

HeadFile::HeadFile(std::filesystem::path path, std::filesystem::path journal)
    : path_(std::move(path)), journal_(std::move(journal)) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode);
  if (descriptor_ < 0) fail(std::string("cannot be opened (") + std::strerror(errno) + ")");
}

HeadFile::~HeadFile() { ::close(descriptor_); }

void HeadFile::fail(const std::string& words) const {
  throw JournalError("journal " + journal_.string() + ": " + path_.filename().string() + " " +
                     words);
}

std::optional<Head> HeadFile::read() {
  std::array<char, 2 * kLine> bytes{};
  const ssize_t got = ::pread(descriptor_, bytes.data(), bytes.size(), 0);
  if (got < 0) fail(std::string("cannot be read (") + std::strerror(errno) + "); check the disk");
  if (got == 0) return std::nullopt;
  const std::string_view text(bytes.data(), static_cast<std::size_t>(got));
  const std::optional<Head> first = head_of(text.substr(0, kLine));
  const std::optional<Head> second =
      text.size() > kLine ? head_of(text.substr(kLine, kLine)) : std::nullopt;
  if (!first && !second) {
    fail("is damaged, so lost newest rows cannot be detected. Remove it to continue");
  }
  const bool first_is_newer = first && (!second || first->entries > second->entries);
  next_line_ = first_is_newer ? 1 : 0;
  return first_is_newer ? first : second;
}

void HeadFile::write(const Head& head) {
  const std::string line = line_of(head);
  const off_t at = next_line_ * static_cast<off_t>(kLine);
  ssize_t put = -1;
  do {
    put = ::pwrite(descriptor_, line.data(), line.size(), at);
  } while (put < 0 && errno == EINTR);
  if (put != static_cast<ssize_t>(line.size()) || ::fdatasync(descriptor_) != 0) {
    fail(std::string("cannot be written (") + std::strerror(errno) +
         "). Make room, or check the disk");
  }
  next_line_ = 1 - next_line_;
}

}  // namespace cellcal::daemon
