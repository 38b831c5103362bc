#include "daemon/archive/archive.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/iso_time.h"
#include "daemon/files/atomic_file.h"
#include "daemon/journal/rows.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kFormat = "cellcal.export/1";
constexpr const char* kManifest = "export.json";
constexpr const char* kRows = "rows.jsonl";
/// Names of the files that are read and written; all others are ignored.
constexpr const char* kNames[] = {kRows,           "cell.toml",   "robot.toml",
                                  "options.json",  "touches.csv", "calibration.json",
                                  "compared.json", "report.html"};
/// A session of 2000 touches takes about 60 MB.
constexpr std::uintmax_t kLargest = std::uintmax_t{512} << 20;

/// SHA-256 of the manifest without its own sum.
std::string sum_of(json manifest) {
  manifest.erase("sum");
  return calib::sha256(manifest.dump());
}

/// Number and sum of the entries, from the first line of the rows.
json counted(const std::string& rows) {
  const json first = json::parse(rows.substr(0, rows.find('\n')));
  return {{"entries", first.at("entries")}, {"entries_sum", first.at("entries_sum")}};
}

/// Number of touches in a validated archive.
std::size_t touches_of(const Archive& archive) {
  return json::parse(archive.at(kManifest)).at("touches").get<std::size_t>();
}

std::string make_manifest(const Archive& archive, const SessionRecord& record) {
  json files = json::array();
  for (const auto& [name, text] : archive)
    files.push_back({{"name", name}, {"sha256", calib::sha256(text)}, {"bytes", text.size()}});
  json manifest{{"format", kFormat},
                {"software", calib::software_version()},
                {"session", record.id},
                {"state", to_string(record.state)},
                {"started", record.started},
                {"ended", record.ended},
                {"touches", record.touches},
                {"rows", counted(archive.at(kRows))},
                {"files", files}};
  manifest["sum"] = sum_of(manifest);
  return manifest.dump(2) + "\n";
}

/// Nothing where the cell file is of a version that is not read any more; the rows have them all.
std::optional<std::string> touches_csv(Journal& journal, const SessionRecord& record) {
  try {
    return calib::format_touches(journal.touches(record.id), cell_of(record.inputs).robot);
  } catch (const calib::FileError&) {  // reported above
    return std::nullopt;
  }
}

[[noreturn]] void refuse(const std::string& from, const std::string& name, const std::string& why) {
  throw ArchiveError((fs::path(from) / name).string() + ": " + why);
}

void check_file(const Archive& archive, const std::string& from, const json& file) {
  const std::string name = file.at("name");
  if (std::find(std::begin(kNames), std::end(kNames), name) == std::end(kNames))
    refuse(from, kManifest, "lists an unknown file: \"" + name + "\"");
  const auto found = archive.find(name);
  if (found == archive.end()) refuse(from, name, "is missing. Export the session again");
  const std::string sum = file.at("sha256");
  if (calib::sha256(found->second) != sum)
    refuse(from, name,
           "differs from the exported file: damaged or altered. Export the session again");
}

bool has_tool(const calib::Cell& cell, const std::string& id) {
  return id.empty() || cell.tool.id == id ||
         std::ranges::find(cell.other_tools, id, &calib::Tool::id) != cell.other_tools.end();
}

/// The cell of a session's row, where this version can read all of it. Throws std::runtime_error.
calib::Cell read_session(const RowEntry& entry) {
  SessionInputs inputs;
  inputs.cell_name = text_of(entry, "cell_name");
  inputs.cell_text = text_of(entry, "cell_text");
  inputs.robot_name = text_of(entry, "robot_name");
  inputs.robot_text = text_of(entry, "robot_text");
  (void)options_from_json(text_of(entry, "options"));
  if (const std::string calibration = text_of(entry, "calibration"); !calibration.empty())
    (void)calib::calibration_from_json(calibration, "calibration");
  return cell_of(inputs);
}

/// Throws std::runtime_error where the touch refers to an unknown target or tool, or to another arm.
void validate_touch(const RowEntry& entry, const calib::Cell& cell) {
  const std::string target = text_of(entry, "target"), tool = text_of(entry, "tool");
  if (std::ranges::find(cell.targets, target, &calib::Target::id) == cell.targets.end())
    throw std::runtime_error(fmt::format("target \"{}\" is not in the cell", printable(target)));
  if (!has_tool(cell, tool))
    throw std::runtime_error(fmt::format("tool \"{}\" is not in the cell", printable(tool)));
  std::size_t turned = 0;
  for (std::size_t i = 0; i < entry.names.size(); ++i) {
    const auto* angles = std::get_if<Blob>(&entry.columns[i]);
    if (angles == nullptr) continue;
    const std::size_t count = angles->bytes.size() / sizeof(double);
    if (entry.names[i] == "positioner_rad") turned = count;
    if (entry.names[i] == "joint_rad" && count != cell.robot.joints.size())
      throw std::runtime_error(fmt::format("joint_rad has {} angles, the robot {} joints", count,
                                           cell.robot.joints.size()));
  }
  if (turned != cell.robot.positioner.size())
    throw std::runtime_error(fmt::format("positioner_rad has {} angles, the positioner {} axes",
                                         turned, cell.robot.positioner.size()));
}

void refuse_unreadable(const SessionRows& rows, const std::string& from) {
  std::optional<calib::Cell> cell;
  const auto visit_rows = [&](const std::string& table, const auto& visit) {
    for (std::size_t i = 0; i < rows.entries.size(); ++i) try {
        if (rows.entries[i].table == table && !rows.entries[i].names.empty())
          visit(rows.entries[i]);
      } catch (const std::runtime_error& unreadable) {
        throw ArchiveError(
            fmt::format("{}:{}: row {} of '{}': {}. No session has such a row: damaged or forged. "
                        "Export the session again",
                        from, i + 2, rows.entries[i].row, table, unreadable.what()));
      }
  };
  visit_rows("session", [&](const RowEntry& entry) { cell = read_session(entry); });
  if (cell) visit_rows("touch", [&](const RowEntry& entry) { validate_touch(entry, *cell); });
}

constexpr std::int64_t kDay = 86400;
constexpr double kMegabyte = 1e6;

class ReplayComparison {
 public:
  explicit ReplayComparison(Replay& result) : result_(result) {}

  void walk(const json* recorded, const json* replayed, const std::string& where) {
    const bool both = recorded != nullptr && replayed != nullptr;
    if (both && recorded->is_object() && replayed->is_object()) {
      std::set<std::string> keys;
      for (const json* object : {recorded, replayed})
        for (const auto& item : object->items()) keys.insert(item.key());
      for (const std::string& key : keys)
        walk(at(recorded, key), at(replayed, key), where + "/" + key);
    } else if (both && recorded->is_array() && replayed->is_array()) {
      for (std::size_t i = 0; i < std::max(recorded->size(), replayed->size()); ++i)
        walk(at(recorded, i), at(replayed, i), where + "/" + std::to_string(i));
    } else {
      ++result_.values;
      if (!both || recorded->dump() != replayed->dump()) differ(recorded, replayed, where);
    }
  }

 private:
  static const json* at(const json* object, const std::string& key) {
    const auto found = object->find(key);
    return found == object->end() ? nullptr : &*found;
  }
  static const json* at(const json* array, std::size_t index) {
    return index < array->size() ? &(*array)[index] : nullptr;
  }

  void differ(const json* recorded, const json* replayed, const std::string& where) {
    if (++result_.differing > 1) return;
    Difference first{where,
                     recorded != nullptr ? recorded->dump() : "",
                     replayed != nullptr ? replayed->dump() : "",
                     {}};
    if (recorded != nullptr && replayed != nullptr && recorded->is_number() &&
        replayed->is_number())
      first.by = replayed->get<double>() - recorded->get<double>();
    result_.first = std::move(first);
  }

  Replay& result_;
};

/// Removes the software version, which is not compared, and the checksum that covers it.
std::string extract_software_version(json& calibration) {
  std::string software;
  calibration.erase("sum");
  if (const auto inputs = calibration.find("inputs"); inputs != calibration.end()) {
    software = inputs->value("software", "");
    inputs->erase("software");
  }
  return software;
}

/// The same computation as in the session.
calib::Calibration again(const SessionRecord& record, const std::vector<calib::Touch>& touches,
                         const std::optional<Compared>& compared, const std::string& from) {
  const SessionOptions options = options_from_json(record.inputs.options);
  if (!options.update) return estimate(cell_of(record.inputs), record.inputs, touches, compared);
  if (!compared)
    throw ArchiveError(from + ": the calibration that this update is based on is missing");
  // Spheres not found are no result; the recorded session states them.
  const auto recorded = calib::calibration_from_json(record.calibration, from);
  return estimate_update(record.inputs, touches, *compared, options.months,
                         recorded.update ? recorded.update->not_found : std::vector<std::string>{});
}

}  // namespace

Archive make_archive(Journal& journal, std::int64_t session, const fs::path& results_dir) {
  const std::string rows = journal.rows(session);
  const auto record = journal.session(session);
  if (!record) throw ArchiveError(fmt::format("no session {}. See 'cellcal history'", session));
  Archive archive{{kRows, rows},
                  {"cell.toml", record->inputs.cell_text},
                  {"robot.toml", record->inputs.robot_text},
                  {"options.json", record->inputs.options + "\n"}};
  if (const auto csv = touches_csv(journal, *record)) archive["touches.csv"] = *csv;
  if (!record->calibration.empty()) archive["calibration.json"] = record->calibration;
  if (const auto compared = journal.compared(session))
    archive["compared.json"] = compared_to_json(*compared);
  if (fs::exists(results_dir / "report.html"))
    archive["report.html"] = calib::read_file(results_dir / "report.html");
  archive[kManifest] = make_manifest(archive, *record);
  return archive;
}

void check_archive(const Archive& archive, const std::string& from) {
  const auto found = archive.find(kManifest);
  if (found == archive.end())
    refuse(from, kManifest,
           "is missing: not an export. Give the directory that 'cellcal export ID DIR' wrote");
  try {
    const json manifest = json::parse(found->second);
    if (manifest.at("format") != kFormat) {
      refuse(from, kManifest,
             fmt::format("has format \"{}\", this version reads \"{}\". Install the newer version",
                         manifest.at("format").get<std::string>(), kFormat));
    }
    if (manifest.at("sum") != sum_of(manifest))
      refuse(from, kManifest, "was changed after it was written. Export the session again");
    (void)manifest.at("touches").get<std::size_t>();
    bool has_rows = false;
    std::set<std::string> listed{kManifest};
    for (const json& file : manifest.at("files")) {
      check_file(archive, from, file);
      listed.insert(file.at("name").get<std::string>());
      has_rows |= file.at("name") == kRows;
    }
    // Names become paths when written, and contents are trusted when read.
    for (const auto& [name, text] : archive)
      if (!listed.contains(name))
        refuse(from, name, "is not listed in export.json. Export the session again");
    if (!has_rows) refuse(from, kManifest, "lists no rows. Export the session again");
    if (manifest.at("rows") != counted(archive.at(kRows)))
      refuse(
          from, kRows,
          "holds other entries than export.json states: damaged or altered. Export the session again");
  } catch (const json::exception&) {
    refuse(from, kManifest, "is not what an export states: damaged. Export the session again");
  }
}

Archive read_archive(const fs::path& directory) {
  std::error_code code;
  if (!fs::is_directory(directory, code))
    throw ArchiveError(directory.string() +
                       (code ? ": cannot be read (" + code.message() + ")" : ": not a directory") +
                       ". Give the directory that 'cellcal export ID DIR' wrote");
  Archive archive;
  const auto take = [&](const char* name) {
    const fs::path file = directory / name;
    if (!fs::exists(file, code)) return;
    const std::uintmax_t size = fs::is_regular_file(file, code) ? fs::file_size(file, code) : 0;
    if (size > kLargest) refuse(directory.string(), name, "is too large for an export");
    archive[name] = calib::read_file(file);
  };
  take(kManifest);
  for (const char* name : kNames) take(name);
  check_archive(archive, directory.string());
  return archive;
}

void write_archive(const Archive& archive, const fs::path& directory) {
  check_archive(archive, directory.string());
  std::error_code code;
  if (fs::exists(directory, code) && !fs::is_empty(directory, code))
    throw ArchiveError(directory.string() + ": exists and is not empty. Choose another directory");
  fs::path part = directory;
  if (!part.has_filename()) part = part.parent_path();
  part += ".part";
  if (!fs::create_directories(part))
    throw ArchiveError(part.string() +
                       ": exists, left by an interrupted export or placed by hand. "
                       "Check it, remove it, export again");
  try {
    for (const auto& [name, text] : archive) write_atomically(part / name, text);
    fs::remove(directory, code);  // fails unless empty
    fs::rename(part, directory.has_filename() ? directory : directory.parent_path());
  } catch (...) {
    fs::remove_all(part, code);
    throw;
  }
}

Imported import_archive(Journal& journal, const Archive& archive, const std::string& from,
                        const std::function<fs::path(std::int64_t)>& results_dir) {
  check_archive(archive, from);
  const std::string name = (fs::path(from) / kRows).string();
  const SessionRows rows = parse_lines(archive.at(kRows), name);
  refuse_impossible(rows, name);
  refuse_unreadable(rows, name);
  const auto [session, is_new] = journal.import(archive.at(kRows), name, touches_of(archive));
  const auto record = journal.session(session);
  const fs::path results = results_dir(session);
  try {
    if (is_new) set_aside(results);  // as after a restored backup, of a session that was lost
  } catch (const std::exception& failed) {
    throw ArchiveError(
        fmt::format("{}. Session {} is in the journal; {} is of another: move it away",
                    system_words(failed), session, results.string()));
  }
  const bool wanted = record && !record->calibration.empty() && record->origin;
  // Also completes an earlier import that stored the rows only.
  if (!wanted || fs::exists(results / "calibration.json")) return {session, is_new};
  try {
    fs::create_directories(results);
    write_atomically(results / "calibration.json", record->calibration);
  } catch (const std::exception& failed) {
    throw ArchiveError(
        fmt::format("{}. Session {} is in the journal, without this file. Check the disk, make "
                    "room, import again",
                    failed.what(), session));
  }
  return {session, is_new};
}

ScratchDirectory::ScratchDirectory() {
  std::string name = (std::filesystem::temp_directory_path() / "cellcal-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw ArchiveError(name + ": cannot create a directory. Set TMPDIR to a writable one");
  path_ = name;
}

ScratchDirectory::~ScratchDirectory() {
  std::error_code ignored;  // left in the directory of temporary files
  std::filesystem::remove_all(path_, ignored);
}

RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now) {
  RetentionLimits limits;
  if (rule.days) {
    const std::chrono::sys_time<std::chrono::milliseconds> before{
        std::chrono::seconds(now - *rule.days * kDay)};
    limits.ended_before = calib::utc_text(before);
  }
  if (rule.megabytes) limits.bytes = std::llround(*rule.megabytes * kMegabyte);
  return limits;
}

Replay compare(const std::string& recorded_text, const std::string& replayed_text) {
  json recorded = json::parse(recorded_text), replayed = json::parse(replayed_text);
  Replay result;
  result.recorded_by = extract_software_version(recorded);
  result.replayed_by = extract_software_version(replayed);
  ReplayComparison(result).walk(&recorded, &replayed, "");
  return result;
}

Replay replay(const Archive& archive, const std::string& from) {
  const ScratchDirectory scratch;
  Journal journal(scratch.path() / "journal.db");
  const auto [session, is_new] = import_archive(
      journal, archive, from, [&](std::int64_t) { return scratch.path() / "results"; });
  const auto record = journal.session(session);
  if (!record) throw ArchiveError(from + ": contains no session");
  if (record->calibration.empty()) {
    throw ArchiveError(from + ": the session produced no calibration (" + to_string(record->state) +
                       (record->failure.empty() ? "" : ": " + record->failure) +
                       "). Only sessions that were identified can be replayed");
  }
  auto compared = journal.compared(session);
  if (const auto file = archive.find("compared.json"); !compared && file != archive.end())
    compared = compared_from_json(file->second);
  const std::vector<calib::Touch> touches = journal.touches(session);
  Replay result = compare(record->calibration,
                          calib::calibration_to_json(again(*record, touches, compared, from)));
  result.touches = touches.size();
  return result;
}

std::string in_words(const Replay& replay) {
  const std::string versions =
      replay.recorded_by == replay.replayed_by
          ? fmt::format("recorded and replayed by {}", replay.replayed_by)
          : fmt::format("recorded by {}, replayed by {}", replay.recorded_by, replay.replayed_by);
  if (replay.same())
    return fmt::format("{} touches, {} values: same to the bit\n{}\n", replay.touches,
                       replay.values, versions);
  const Difference& first = *replay.first;
  const auto or_missing = [](const std::string& text) { return text.empty() ? "nothing" : text; };
  return fmt::format(
      "{} touches, {} values: {} differ\n{}\nfirst: {}: {} recorded, {} replayed{}\n",
      replay.touches, replay.values, replay.differing, versions, first.where,
      or_missing(first.recorded), or_missing(first.replayed),
      first.by ? fmt::format(" (difference {:.3g})", *first.by) : "");
}

}  // namespace cellcal::daemon
