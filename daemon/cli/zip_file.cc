#include "daemon/cli/zip_file.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>

#include "calib/files/text.h"
#include "calib/model/error.h"

namespace cellcal::daemon {

namespace {

// APPNOTE.TXT 4.3: central directory at the end, sizes little-endian.
constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr std::size_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22,
                      kLongestComment = 0xffff;
constexpr int kStored = 0, kDeflated = 8;

class ZipReader {
 public:
  ZipReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw calib::FileError(name_, ": " + what);
  }
  std::uint32_t number(std::size_t at, std::size_t count) const {
    need(at, count);
    std::uint32_t value = 0;
    for (std::size_t i = count; i-- > 0;)
      value = value << 8 | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }
  std::string_view text(std::size_t at, std::size_t count) const {
    need(at, count);
    return bytes_.substr(at, count);
  }
  /// Where the end record stands.
  std::size_t end_record() const {
    if (bytes_.size() >= kEndBytes)
      for (std::size_t back = 0; back <= std::min(bytes_.size() - kEndBytes, kLongestComment);
           ++back)
        if (number(bytes_.size() - kEndBytes - back, 4) == kEnd)
          return bytes_.size() - kEndBytes - back;
    fail("not a ZIP archive, or cut off");
  }

 private:
  void need(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at) fail("ZIP archive damaged");
  }
  std::string_view bytes_;
  const std::string& name_;
};

std::string inflated(const ZipReader& archive, std::string_view packed, std::size_t size) {
  std::string text(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) archive.fail("ZIP archive cannot be unpacked");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(size);
  const int end = inflate(&stream, Z_FINISH);
  const std::size_t got = stream.total_out;
  inflateEnd(&stream);
  if (end != Z_STREAM_END || got != size) archive.fail("ZIP archive damaged");
  return text;
}

/// The file of the central directory's entry at `at`.
std::string unpacked(const ZipReader& archive, std::size_t at, const std::string& path) {
  if ((archive.number(at + 8, 2) & 1) != 0) archive.fail(calib::shown(path) + " is encrypted");
  const auto method = static_cast<int>(archive.number(at + 10, 2));
  if (method != kStored && method != kDeflated)
    archive.fail(fmt::format("{} is packed by method {}, not deflate", calib::shown(path), method));
  const std::size_t packed = archive.number(at + 20, 4), size = archive.number(at + 24, 4);
  const std::size_t local = archive.number(at + 42, 4);
  if (archive.number(local, 4) != kLocal) archive.fail("ZIP archive damaged");
  const std::size_t begin =
      local + kLocalBytes + archive.number(local + 26, 2) + archive.number(local + 28, 2);
  const std::string_view bytes = archive.text(begin, packed);
  if (method == kStored && packed != size) archive.fail("ZIP archive damaged");
  std::string text = method == kStored ? std::string(bytes) : inflated(archive, bytes, size);
  const auto sum =
      crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  if (sum != archive.number(at + 16, 4)) archive.fail(calib::shown(path) + " is damaged");
  return text;
}

}  // namespace

std::vector<ZippedFile> unzip(std::string_view bytes, const std::string& name,
                              const std::function<bool(std::string_view)>& wanted,
                              std::size_t most_bytes) {
  const ZipReader archive(bytes, name);
  const std::size_t end = archive.end_record();
  const std::size_t count = archive.number(end + 10, 2);
  std::size_t at = archive.number(end + 16, 4), total = 0;
  std::vector<ZippedFile> files;
  for (std::size_t i = 0; i < count; ++i) {
    if (archive.number(at, 4) != kCentral) archive.fail("ZIP archive damaged");
    const std::size_t length = archive.number(at + 28, 2);
    std::string path(archive.text(at + kCentralBytes, length));
    if (wanted(path)) {
      total += archive.number(at + 24, 4);
      if (total > most_bytes) archive.fail(fmt::format("more than {} MB in it", most_bytes >> 20));
      std::string text = unpacked(archive, at, path);
      files.push_back({std::move(path), std::move(text)});
    }
    at += kCentralBytes + length + archive.number(at + 30, 2) + archive.number(at + 32, 2);
  }
  return files;
}

}  // namespace cellcal::daemon
