#include "daemon/archive/replay.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/calibration_json.h"
#include "daemon/archive/archive.h"
#include "daemon/tasks/check_against.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

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
