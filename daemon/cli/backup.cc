#include "daemon/cli/backup.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using calib::krl::KrlFile;

constexpr std::size_t kMostBackupFiles = 10000, kMostBackupBytes = 256u << 20;

bool is_krl(std::string_view path) {
  const std::string name = calib::krl::lower_case(std::string(path));
  return name.ends_with(".src") || name.ends_with(".dat") || name.ends_with(".sub");
}

/// DEF, DEFFCT or DEFDAT at the beginning of a word.
bool defines(const KrlFile& file) {
  const bool dat = calib::krl::lower_name(file.name).ends_with(".dat");
  const std::string text = calib::krl::lower_case(file.text), word = dat ? "defdat" : "def";
  for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    if (at == 0 || std::string_view(" \t\r\n").find(text[at - 1]) != std::string_view::npos)
      return true;
  return false;
}

/// Options keep data of their own, binary or of long lines, in files named .dat; other tools UTF-16 and binary data
/// (macOS "._NAME") in files named .src.
bool is_no_krl(const KrlFile& file) {
  const std::string name = calib::krl::lower_name(file.name);
  if (name == "$config.dat" || name == "$machine.dat" || defines(file)) return false;
  if (file.text.find('\0') != std::string::npos) return true;
  if (name.starts_with('$')) return false;
  try {
    calib::krl::read_lines(file);
    return false;
  } catch (const calib::FileError&) {
    return true;
  }
}

/// Path without the extension.
std::string module_of(const KrlFile& file) {
  return calib::krl::lower_case(fs::path(file.name).replace_extension().string());
}

/// `programs`: the modules with statements. What a program or the system states cannot be left: others may depend on it.
bool may_be_left(const KrlFile& file, const std::set<std::string>& programs) {
  const std::string name = calib::krl::lower_name(file.name);
  return name.ends_with(".dat") && !name.starts_with('$') && !programs.contains(module_of(file));
}

/// True for the files in `backup` to be read.
bool takes(Backup& backup, std::string_view path) {
  if (calib::krl::lower_case(std::string(path)).ends_with(".zip")) backup.archive = path;
  return is_krl(path);
}

Backup read_folder(const fs::path& folder) {
  Backup backup;
  std::size_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!takes(backup, entry.path().string()) || !entry.is_regular_file()) continue;
    backup.files.push_back({fs::relative(entry.path(), folder).string(),
                            calib::read_file(entry.path(), kMostBackupBytes)});
    bytes += backup.files.back().text.size();
    if (backup.files.size() > kMostBackupFiles || bytes > kMostBackupBytes)
      throw calib::FileError(folder.string(), ": more than 10000 KRL files, or 256 MB of them");
  }
  return backup;
}

Backup read_zip(const fs::path& path) {
  Backup backup;
  for (ZippedFile& one : unzip(
           calib::read_file(path, kMostBackupBytes), path.string(),
           [&](std::string_view inside) { return takes(backup, inside); }, kMostBackupBytes))
    backup.files.push_back({std::move(one.path), std::move(one.text)});
  return backup;
}

/// The controller's side has others of these names.
bool is_of_the_arm(const std::string& path) {
  static const std::set<std::string> names = {"$machine.dat", "$robcor.dat", "$config.dat",
                                              "$custom.dat", "$option.dat"};
  return names.contains(calib::krl::lower_name(path)) && !is_of_the_controllers_side(path);
}

void refuse_two_robots(const std::string& place, const std::vector<KrlFile>& files) {
  std::map<std::string, const KrlFile*> seen;
  for (const KrlFile& file : files) {
    if (!is_of_the_arm(file.name)) continue;
    const auto [first, fresh] = seen.emplace(calib::krl::lower_name(file.name), &file);
    if (!fresh && first->second->text != file.text)
      throw calib::FileError(place, ": both " + first->second->name + " and " + file.name +
                                        ". Give the files of one robot");
  }
}

struct CloseZip {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using ZipArchive = std::unique_ptr<zip_t, CloseZip>;

ZipArchive open_zip(std::string_view bytes, const std::string& name) {
  // libzip takes it for an archive without files.
  if (bytes.empty()) throw calib::FileError(name, ": empty (0 bytes). Copy it again");
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, nullptr);
  zip_t* archive = source == nullptr
                       ? nullptr
                       : zip_open_from_source(source, ZIP_RDONLY | ZIP_CHECKCONS, nullptr);
  if (archive != nullptr) return ZipArchive(archive);
  zip_source_free(source);
  throw calib::FileError(
      name,
      bytes.starts_with("PK")
          ? ": not a ZIP archive, or damaged. Copy it again"
          : ": neither folder nor ZIP archive. Unpack other archives (.rar, .7z) and give the "
            "folder; a single program goes to --program");
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

bool is_of_the_controllers_side(const std::string& path) {
  std::string all = "/" + calib::krl::lower_case(path);
  std::replace(all.begin(), all.end(), '\\', '/');
  return all.find("/steu/") != std::string::npos ||
         all.find("/roboter/template/") != std::string::npos;
}

Backup read_backup(const fs::path& place) {
  Backup backup = fs::is_directory(place) ? read_folder(place) : read_zip(place);
  std::ranges::sort(backup.files, {}, &KrlFile::name);
  std::set<std::string> programs;
  for (const KrlFile& file : backup.files)
    if (!calib::krl::lower_name(file.name).ends_with(".dat")) programs.insert(module_of(file));
  std::erase_if(backup.files, [&](const KrlFile& file) {
    const bool large = file.text.size() > calib::krl::kMostBytes;
    const bool left = large ? may_be_left(file, programs) : is_no_krl(file);
    if (left) (large ? backup.large : backup.others).push_back(file.name);
    return left;
  });
  refuse_two_robots(place.string(), backup.files);
  return backup;
}

bool may_state_accuracy(const std::string& path) {
  static const std::set<std::string> names = {"$option.dat", "$custom.dat", "$machine.dat"};
  const std::string name = calib::krl::lower_name(path);
  return is_of_the_controllers_side(path) ? names.contains(name) : name.starts_with('$');
}

calib::MachineData read_machine_files(const std::vector<fs::path>& places) {
  calib::MachineData data;
  std::vector<KrlFile> alone;
  for (const fs::path& place : places) {
    const bool archive = calib::krl::lower_name(place.string()).ends_with(".zip");
    if (!archive && !fs::is_directory(place)) {
      alone.push_back({place.string(), calib::read_file(place)});
      calib::read_machine_data(alone.back().text, place.string(), data);
      continue;
    }
    bool found = false;
    for (const KrlFile& file : read_backup(place).files) {
      if (is_of_the_arm(file.name)) {
        found = true;
        calib::read_machine_data(file.text, file.name, data);
      } else if (is_of_the_controllers_side(file.name) && may_state_accuracy(file.name)) {
        calib::read_absolute_accuracy(file.text, file.name, data);
      }
    }
    if (!found)
      throw calib::FileError(place.string(), ": no $machine.dat, $robcor.dat or $config.dat in it");
  }
  refuse_two_robots("machine data", alone);
  if (const std::string two = calib::two_robots(data); !two.empty())
    fmt::print(stderr, "warning: {}\n", two);
  return data;
}

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
    std::string path = file.name;
    std::ranges::replace(path, '\\', '/');  // as of old tools of Windows
    if (!wanted(path)) continue;
    if (file.size > left)
      throw calib::FileError(name, fmt::format(": more than {} MB in it", most_bytes >> 20));
    left -= file.size;
    files.push_back({std::move(path), unpacked(archive.get(), file, name)});
  }
  return files;
}

}  // namespace cellcal::daemon
