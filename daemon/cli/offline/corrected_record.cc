#include "daemon/cli/offline/corrected_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/model/error.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kFormat = "cellcal.corrected/1";
constexpr std::size_t kMostBytes = 64u << 20;

Json read_record(const fs::path& path) {
  const Json record = Json::parse(calib::read_file(path, kMostBytes), nullptr, false);
  if (record.is_object() && record.value("format", Json()) == kFormat &&
      record.value("files", Json()).is_array())
    return record;
  throw calib::FileError(
      path.string(),
      ": not a record of a correction. Move it away if the program in the same folder is the "
      "original");
}

/// A file that the correction left as it was is the original still.
bool wrote(const Json& record, const std::string& text) {
  const std::string sum = calib::sha256(text);
  const Json& files = record.at("files");
  return std::any_of(files.begin(), files.end(), [&](const Json& file) {
    return file.is_object() && file.value("sha256", Json()) == sum &&
           file.value("sha256_before", Json()) != sum;
  });
}

}  // namespace

fs::path record_beside(fs::path src) { return src.replace_extension(".corrected.json"); }

void refuse_corrected(const krl::ProgramFiles& files) {
  const fs::path path = record_beside(files.src.name);
  if (!fs::exists(path)) return;
  const Json record = read_record(path);
  for (const krl::KrlFile* file : {&files.src, files.dat ? &*files.dat : nullptr})
    if (file != nullptr && wrote(record, file->text))
      throw calib::FileError(file->name, ": is corrected already (" + path.string() +
                                             "). Correct the original program instead");
}

Json corrected_record(Json report, const krl::ProgramFiles& read,
                      const std::vector<krl::KrlFile>& written) {
  report["format"] = kFormat;
  report["files"] = Json::array();
  for (const krl::KrlFile& file : written) {
    const std::string& before = file.name == read.src.name ? read.src.text : read.dat->text;
    report["files"].push_back({{"name", fs::path(file.name).filename().string()},
                               {"sha256_before", calib::sha256(before)},
                               {"sha256", calib::sha256(file.text)}});
  }
  return report;
}

}  // namespace cellcal::daemon
