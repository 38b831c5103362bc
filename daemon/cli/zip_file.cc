#include "daemon/cli/zip_file.h"

#include <fmt/format.h>
#include <zip.h>

#include <memory>

#include "calib/files/text.h"
#include "calib/model/error.h"

namespace cellcal::daemon {

namespace {

struct CloseZip {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using ZipArchive = std::unique_ptr<zip_t, CloseZip>;

ZipArchive open_zip(std::string_view bytes, const std::string& name) {
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, nullptr);
  zip_t* archive = source == nullptr
                       ? nullptr
                       : zip_open_from_source(source, ZIP_RDONLY | ZIP_CHECKCONS, nullptr);
  if (archive != nullptr) return ZipArchive(archive);
  zip_source_free(source);
  throw calib::FileError(name, ": not a ZIP archive, or damaged. Copy it again");
}

/// Throws FileError unless the file is complete and of the stated size and checksum.
std::string unpacked(zip_t* archive, const zip_stat_t& file, const std::string& name) {
  const std::string path = calib::shown(file.name);
  if (file.encryption_method != ZIP_EM_NONE)
    throw calib::FileError(name, ": " + path + " is encrypted. Save it without a password");
  const std::unique_ptr<zip_file_t, CloseZip> open(zip_fopen_index(archive, file.index, 0));
  if (open == nullptr)
    throw calib::FileError(name, fmt::format(": {} (method {}) cannot be unpacked: {}", path,
                                             file.comp_method, zip_strerror(archive)));
  std::string text(file.size, '\0');
  char beyond = 0;  // the checksum is compared at the end of the file
  if (zip_fread(open.get(), text.data(), text.size()) != static_cast<zip_int64_t>(text.size()) ||
      zip_fread(open.get(), &beyond, 1) != 0)
    throw calib::FileError(name, ": " + path + " is damaged. Copy the archive again");
  return text;
}

}  // namespace

std::vector<ZippedFile> unzip(std::string_view bytes, const std::string& name,
                              const std::function<bool(std::string_view)>& wanted,
                              std::size_t most_bytes) {
  const ZipArchive archive = open_zip(bytes, name);
  const auto count = static_cast<zip_uint64_t>(zip_get_num_entries(archive.get(), 0));
  std::size_t left = most_bytes;
  std::vector<ZippedFile> files;
  for (zip_uint64_t i = 0; i < count; ++i) {
    zip_stat_t file;
    if (zip_stat_index(archive.get(), i, 0, &file) != 0 || (file.valid & ZIP_STAT_SIZE) == 0)
      throw calib::FileError(name, ": damaged. Copy it again");
    if (!wanted(file.name)) continue;
    if (file.size > left)
      throw calib::FileError(name, fmt::format(": more than {} MB in it", most_bytes >> 20));
    left -= file.size;
    files.push_back({file.name, unpacked(archive.get(), file, name)});
  }
  return files;
}

}  // namespace cellcal::daemon
