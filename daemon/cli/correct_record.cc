// Output of cellcal correct, and the record by which it refuses a second correction.

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using krl::KrlFile;

constexpr const char* kFormat = "cellcal.corrected/1";
constexpr std::size_t kMostRecordBytes = 64u << 20;
/// Record in the folder of a corrected backup.
constexpr const char* kBackupRecord = "cellcal.corrected.json";

fs::path record_beside(fs::path src) { return src.replace_extension(".corrected.json"); }

/// Records that may list the file: its module's, and those of a backup that it is in.
void add_records(const fs::path& file, std::set<fs::path>& records) {
  std::error_code none;
  const auto add = [&](const fs::path& record) {
    if (fs::exists(record, none)) records.insert(record);
  };
  add(record_beside(file));
  for (fs::path in = fs::absolute(file).lexically_normal(); in.has_relative_path();
       in = in.parent_path())
    add(in.parent_path() / kBackupRecord);
}

Json read_record(const fs::path& path) {
  Json record = Json::parse(calib::read_file(path, kMostRecordBytes), nullptr, false);
  if (record.is_object() && record.value("format", Json()) == kFormat &&
      record.value("files", Json()).is_array())
    return record;
  throw calib::FileError(
      path.string(),
      ": not a record of a correction. Move it away if the programs in its folder are the "
      "originals");
}

/// SHA-256 of the files that the correction wrote. One that it left unchanged is still the original.
std::vector<std::string> written_by(const Json& record) {
  std::vector<std::string> sums;
  for (const Json& file : record.at("files"))
    if (file.is_object() && file.value("sha256", Json()).is_string() &&
        file.at("sha256") != file.value("sha256_before", Json()))
      sums.push_back(file.at("sha256"));
  return sums;
}

/// Why a file of the record is not to be corrected like this; empty: it is.
std::string refusal(const CorrectCommand& command, const Json& record, const std::string& place) {
  const fs::path& taught = command.upload ? command.calibration : command.from;
  if (record.value("uploaded", Json()) == true) {
    if (command.upload) return ": is taken back already (" + place + ")";
    return taught.empty() ? ""
                          : ": has the points of the offline system (" + place +
                                "). Correct it without --from";
  }
  if (record.contains("fix_module"))
    return ": is corrected already, while it runs (" + place +
           "). Correct the original program, which --restore gives back";
  if (taught.empty())
    return ": is corrected already (" + place + "). Correct the original program instead" +
           (command.at_run_time
                ? ""
                : ", or give the calibration that it was corrected with: --from OLD.json");
  const Json with = record.value("calibration_sha256", Json());
  if (with == calib::sha256(calib::read_file(taught))) return "";
  const Json name = record.value("calibration", Json());
  return ": was corrected with another calibration than " + taught.string() + ": " +
         (name.is_string() ? name.get<std::string>() + ", " : "") + "SHA-256 " +
         (with.is_string() ? with.get<std::string>() : "not stated") + " (" + place +
         "). Give that one";
}

/// Throws where this is the file that was read.
fs::path place_of(const CorrectCommand& command, const KrlFile& file) {
  const fs::path name = file.name;
  const bool alone =
      command.backup.empty() || std::ranges::any_of(command.controller, [&](const fs::path& given) {
        return fs::absolute(given) == name;
      });
  const fs::path inside = alone ? name.filename() : name.lexically_normal();
  if (inside.is_absolute() || inside.string().starts_with(".."))
    throw calib::FileError(file.name, ": leads out of the backup");
  const fs::path place = command.output / inside, read = alone ? name : command.backup / inside;
  if (fs::exists(place) && fs::exists(read) && fs::equivalent(place, read))
    throw calib::FileError(place.string(),
                           ": is the program itself; write to another folder with -o");
  return place;
}

/// The report with the SHA-256 of each file as read and as written, and of the calibration.
Json corrected_record(const CorrectCommand& command, Json report, const std::vector<KrlFile>& read,
                      const std::vector<KrlFile>& corrected) {
  report["format"] = kFormat;
  report["calibration"] = command.calibration.filename().string();
  report["calibration_sha256"] = calib::sha256(calib::read_file(command.calibration));
  report["uploaded"] = command.upload;
  report["files"] = Json::array();
  for (const KrlFile& file : corrected) {
    const auto before = std::ranges::find(read, file.name, &KrlFile::name);
    report["files"].push_back({{"name", fs::path(file.name).filename().string()},
                               {"sha256_before", calib::sha256(before->text)},
                               {"sha256", calib::sha256(file.text)}});
  }
  return report;
}

}  // namespace

void refuse_corrected(const CorrectCommand& command, const fs::path& folder,
                      const std::vector<KrlFile>& files) {
  std::set<fs::path> records;
  for (const KrlFile& file : files) add_records(folder / file.name, records);
  if (records.empty()) return;
  std::map<std::string, std::string> refused;  // by SHA-256
  for (const fs::path& path : records) {
    const Json record = read_record(path);
    const std::string why = refusal(command, record, path.string());
    for (const std::string& sum : written_by(record)) refused.emplace(sum, why);
  }
  for (const KrlFile& file : files)
    if (const auto found = refused.find(calib::sha256(file.text));
        found != refused.end() && !found->second.empty())
      throw calib::FileError(file.name, found->second);
}

void refuse_to_replace(const CorrectCommand& command, const fs::path& place) {
  if (!command.force && fs::exists(place))
    throw calib::FileError(place.string(),
                           ": exists. Replace it with --force, or write to another folder");
}

std::string write_corrected(const CorrectCommand& command, const std::vector<KrlFile>& read,
                            const std::vector<KrlFile>& corrected, const std::vector<KrlFile>& more,
                            Json& report) {
  if (corrected.empty() || command.output.empty()) return {};
  std::vector<KrlFile> files;
  for (const KrlFile& file : corrected)
    files.push_back({place_of(command, file).string(), file.text});
  for (const KrlFile& file : more)
    files.push_back({(command.output / file.name).string(), file.text});
  const fs::path record =
      command.backup.empty() ? record_beside(files.front().name) : command.output / kBackupRecord;
  std::set<std::string> places;
  for (const KrlFile& file : files) {
    if (!places.insert(file.name).second)
      throw calib::FileError(file.name, ": program and points have one name");
    refuse_to_replace(command, file.name);
    read_back(file.text, file.name, as_krl);
    report["written"].push_back(file.name);
  }
  refuse_to_replace(command, record);
  report["written"].push_back(record.string());
  fs::create_directories(record.parent_path());
  // The record first: a corrected program without it would pass for the original.
  write_atomically(record, json_text(corrected_record(command, report, read, corrected)));
  // Last the programs, which call what the others define.
  for (auto file = files.rbegin(); file != files.rend(); ++file) {
    fs::create_directories(fs::path(file->name).parent_path());
    write_atomically(file->name, file->text);
  }
  std::string words;
  for (const Json& place : report["written"])
    words += said({"say.correct.written", {{"file", place.get<std::string>()}}});
  if (!command.at_run_time && !command.upload)
    words += said({"say.correct.keep", {{"calibration", command.calibration.string()}}});
  return words;
}

}  // namespace cellcal::daemon
