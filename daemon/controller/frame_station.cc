#include "daemon/controller/frame_station.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/json_fields.h"
#include "calib/model/enum_table.h"
#include "daemon/files/atomic_file.h"
#include "drivers/units.h"

namespace cellcal::daemon {

namespace {

using drivers::EkiFrameEnd;
using drivers::EkiFrameKind;
using drivers::EkiFrameResult;
using drivers::EkiFrameValues;
using drivers::kRadPerDeg;
using drivers::same_frame;
using Why = FrameNotSent::Why;

// Beyond the reach of any robot, and any angle shown by a controller.
constexpr double kFarthestMm = 30000.0, kLargestDeg = 360.0;
constexpr std::size_t kMostBytes = 4 << 20;

/// First component that is not finite or out of range.
std::optional<std::string> unsound(const EkiFrameValues& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double limit = i < 3 ? kFarthestMm : kLargestDeg;
    if (!(std::abs(values[i]) <= limit))
      return fmt::format("{} {} must be a number within {}", "XYZABC"[i], values[i], limit);
  }
  return std::nullopt;
}

void require_sound(const FrameName& name, const EkiFrameValues& values) {
  if (const auto wrong = unsound(values))
    throw FrameNotSent(Why::kUnusable, fmt::format("{}: {}", to_string(name), *wrong));
}

/// Rejects values that could not be restored.
void require_sound_on_controller(const FrameName& name, const EkiFrameValues& now) {
  if (const auto wrong = unsound(now))
    throw FrameNotSent(
        Why::kController,
        fmt::format("{} on the controller: {}. Nothing was sent; correct it at the pendant",
                    to_string(name), *wrong));
}

double apart_mm(const EkiFrameValues& a, const EkiFrameValues& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Rz(A) Ry(B) Rx(C).
Eigen::Quaterniond rotation_of(const EkiFrameValues& frame) {
  return Eigen::AngleAxisd(frame[3] * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(frame[4] * kRadPerDeg, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(frame[5] * kRadPerDeg, Eigen::Vector3d::UnitX());
}

double turned_deg(const EkiFrameValues& from, const EkiFrameValues& to) {
  return rotation_of(from).angularDistance(rotation_of(to)) * drivers::kDegPerRad;
}

FrameOutcome outcome_of(EkiFrameEnd end) {
  using enum EkiFrameEnd;
  static constexpr EnumTable<EkiFrameEnd, FrameOutcome> kTable{
      {{kRead, FrameOutcome::kNotSent},
       {kSet, FrameOutcome::kSet},
       {kDiffers, FrameOutcome::kDiffers},
       {kRefused, FrameOutcome::kRefused},
       {kNotSent, FrameOutcome::kNotSent},
       {kUnknown, FrameOutcome::kUnknown}}};
  return kTable[end];
}

using calib::JsonReader;
using calib::fields::field, calib::fields::list, calib::fields::named, calib::fields::nullable,
    calib::fields::object, calib::fields::text, calib::fields::whole;
using calib::fields::Json, calib::fields::Table, calib::fields::Value;
using nlohmann::json;

constexpr const char* kFormat = "cellcal.frames/1";
constexpr int kMostNumber = 128;  // of TOOL_DATA and BASE_DATA on any controller

Value<EkiFrameValues> frame_values() {
  return {[](const EkiFrameValues& values) -> Json { return values; },
          [](const JsonReader& r) {
            const std::vector<JsonReader> items = r.items();
            EkiFrameValues values{};
            if (items.size() != values.size()) r.fail("must have six values");
            std::ranges::transform(items, values.begin(), &JsonReader::number);
            return values;
          }};
}

Table<FrameRecord> record_fields() {
  using R = FrameRecord;
  const Value<FrameName> frame{[](const FrameName& name) -> Json { return to_string(name); },
                               [](const JsonReader& r) {
                                 const auto name = frame_name(r.text());
                                 if (!name) r.fail("is no frame");
                                 return *name;
                               }};
  return {field("id", &R::id, whole<int>()),
          field("time", &R::time, text()),
          field("by", &R::by, text()),
          field("reason", &R::reason, text()),
          field("frame", &R::name, frame),
          field("before", &R::before, frame_values()),
          field("sent", &R::sent, frame_values()),
          nullable("read_back", &R::read_back, frame_values()),
          field("outcome", &R::outcome, named<FrameOutcome, ' '>()),
          field("words", &R::words, text()),
          nullable("restores", &R::restores, whole<int>())};
}

using drivers::EkiFrameDone;
using drivers::EkiFrameTrouble;

constexpr const char* kInSessionWords = "a session is running on the controller. Wait for its end";
constexpr const char* kMovesWords = "the arm is moving. Release the jog keys, and try again";
constexpr const char* kClosedWords =
    "the controller closed the connection; or another client still has it: try again in 15 s";
constexpr const char* kNotAStreamWords =
    "the answer is longer than 8192 bytes: this is not cellcal's program";

std::string no_connection_words(const std::string& peer, const std::string& detail) {
  return fmt::format(
      "no connection to {} ({}). Check the network, and that the controller's submit "
      "interpreter runs CELLCAL_SUB; or another client still has it: try again in 15 s",
      peer, detail);
}

std::string no_state_words(const std::string& peer) {
  return fmt::format(
      "no state from {}. Check that the submit interpreter runs CELLCAL_SUB; or another client still "
      "has it: try again in 15 s",
      peer);
}

std::string refusal_words(EkiFrameDone refusal) {
  switch (refusal) {
    case EkiFrameDone::kInSession: return kInSessionWords;
    case EkiFrameDone::kMoves: return kMovesWords;
    case EkiFrameDone::kNoSuchNumber:
      return "number not in the controller's program (TOOL_DATA 1 to 16, BASE_DATA 1 to 32)";
    case EkiFrameDone::kOtherProgram:
      return "another program runs on the controller. Stop it, and try again";
    case EkiFrameDone::kIncomplete:
      return "incomplete telegram at the controller. Try again; if it repeats, reinstall the files "
             "of 'cellcal kuka-files', the channel file too, then cold start";
    case EkiFrameDone::kNotYet:
    case EkiFrameDone::kDone: break;
  }
  return "refused by the controller, no reason given. See the message on the pendant";
}

std::string trouble_words(const EkiFrameResult& result) {
  switch (result.trouble) {
    case EkiFrameTrouble::kNoConnection: return no_connection_words(result.peer, result.detail);
    case EkiFrameTrouble::kNoState: return no_state_words(result.peer);
    case EkiFrameTrouble::kTooOld:
      return "controller files without frame support. Install those that 'cellcal kuka-files' "
             "writes with [eki] write_frames = true, then cold start";
    case EkiFrameTrouble::kInSession: return kInSessionWords;
    case EkiFrameTrouble::kMoves: return kMovesWords;
    case EkiFrameTrouble::kClosed: return kClosedWords;
    case EkiFrameTrouble::kNoAnswer: return "no answer in time";
    case EkiFrameTrouble::kOtherFrame: return "the answer is for another frame";
    case EkiFrameTrouble::kNotAStream: return kNotAStreamWords;
    case EkiFrameTrouble::kNoTelegram: return "the values do not fit into a telegram";
    case EkiFrameTrouble::kNone: break;
  }
  return result.detail;
}

}  // namespace

FrameStation::FrameStation(Parts parts) : parts_(std::move(parts)) {
  if (!std::filesystem::exists(parts_.file)) return;
  try {
    records_ = frames_from_json(calib::read_file(parts_.file, kMostBytes), parts_.file.string());
  } catch (const std::exception& damaged) {
    problem_ =
        std::string(damaged.what()) +
        ". It holds the old values of frames. Move it aside and keep it, then restart cellcald; "
        "no frame is set before that";
  }
}

std::vector<FrameRecord> FrameStation::records() const {
  const std::lock_guard lock(mutex_);
  return records_;
}

void FrameStation::store(const std::vector<FrameRecord>& records) const {
  try {
    write_atomically(parts_.file, frames_to_json(records));
  } catch (const std::exception& error) {
    throw FrameNotSent(Why::kStorage, error.what());
  }
}

EkiFrameResult FrameStation::ask(const FrameName& name,
                                 const drivers::EkiFrameChoice& choice) const {
  if (!problem_.empty()) throw FrameNotSent(Why::kStorage, problem_);
  const Exchange exchange = parts_.exchange();
  if (!exchange) throw FrameNotSent(Why::kNotConfigured, not_configured_words());
  try {
    return exchange({name.kind, name.number, std::nullopt}, choice);
  } catch (const FrameNotSent&) {
    throw;
  } catch (const std::exception& error) {
    throw FrameNotSent(Why::kController, error.what());
  }
}

EkiFrameValues FrameStation::read(const FrameName& name) {
  const EkiFrameResult result = ask(name, {});
  if (result.end != EkiFrameEnd::kRead || !result.new_values)
    throw FrameNotSent(Why::kController, not_sent_words(name, result));
  require_sound_on_controller(name, *result.new_values);
  return *result.new_values;
}

void FrameStation::require_same_tool(const FrameOrder& order, const EkiFrameValues& now) const {
  const double mm = apart_mm(now, order.values), deg = turned_deg(now, order.values);
  if (mm <= parts_.another_tool_mm && deg <= parts_.another_tool_deg) return;
  throw FrameNotSent(
      Why::kUnusable,
      fmt::format(
          "{} on the controller is {:.1f} mm and {:.1f} deg from what was to be set (limits "
          "{:.0f} mm, {:.0f} deg): another tool's number. Give the number of the tool that "
          "touched, or measure it roughly first",
          to_string(order.name), mm, deg, parts_.another_tool_mm, parts_.another_tool_deg));
}

FrameRecord FrameStation::set(const FrameOrder& order) {
  require_sound(order.name, order.values);
  return replace(order.name, [&](const EkiFrameValues& now) {
    if (!same_frame(order.was, now))
      throw FrameNotSent(Why::kChanged,
                         fmt::format("{} on the controller is {}, not what was confirmed: {}. "
                                     "Nothing was sent; look at it and confirm again",
                                     to_string(order.name), krl_text(now), krl_text(order.was)));
    if (order.name.kind == EkiFrameKind::kTool) require_same_tool(order, now);
    FrameRecord record;
    record.by = order.by;
    record.reason = order.reason;
    record.sent = order.values;
    return record;
  });
}

FrameRecord FrameStation::restore(int id, const std::string& by) {
  if (!problem_.empty()) throw FrameNotSent(Why::kStorage, problem_);
  const auto original = find(id);
  if (!original)
    throw FrameNotSent(
        Why::kNoSuchRecord,
        fmt::format("no frame was sent under number {}. See 'cellcal frames --sent'", id));
  require_sound(original->name, original->before);
  return replace(original->name, [&](const EkiFrameValues& now) {
    const bool as_left = same_frame(original->sent, now) || same_frame(original->before, now) ||
                         (original->read_back && same_frame(*original->read_back, now));
    if (!as_left)
      throw FrameNotSent(
          Why::kChanged,
          fmt::format(
              "{} on the controller is {}: neither what number {} sent nor what was before it, {}. "
              "It was changed since; set it at the pendant",
              to_string(original->name), krl_text(now), id, krl_text(original->before)));
    FrameRecord back;
    back.by = by;
    back.reason = fmt::format("old values of {} again", id);
    back.sent = original->before;
    back.restores = id;
    return back;
  });
}

std::optional<FrameRecord> FrameStation::find(int id) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(records_, id, &FrameRecord::id);
  return found == records_.end() ? std::nullopt : std::optional(*found);
}

FrameRecord FrameStation::replace(
    const FrameName& name, const std::function<FrameRecord(const EkiFrameValues& now)>& order) {
  const std::lock_guard lock(one_at_a_time_);
  std::optional<FrameRecord> record;
  EkiFrameResult result;
  try {
    result = ask(name, [&](const EkiFrameValues& now) {
      require_sound_on_controller(name, now);
      FrameRecord next = order(now);
      next.name = name;
      next.before = now;
      note_before(next);
      record = next;
      return std::optional(next.sent);
    });
  } catch (const FrameNotSent& error) {
    if (!record) throw;
    // Failed after the record was written: the progress is unknown.
    result.end = EkiFrameEnd::kUnknown;
    result.detail = error.what();
  }
  if (!record) throw FrameNotSent(Why::kController, not_sent_words(name, result));
  record->outcome = outcome_of(result.end);
  if (result.old_values) record->before = *result.old_values;
  record->read_back = result.new_values;
  record->words = outcome_words(*record, result);
  note_after(*record);
  if (record->outcome == FrameOutcome::kRefused || record->outcome == FrameOutcome::kNotSent)
    throw FrameNotSent(Why::kController, record->words);
  return *record;
}

/// Written to disk as 'unknown' before anything is sent, so that the old values survive a killed daemon.
void FrameStation::note_before(FrameRecord& record) {
  const std::lock_guard lock(mutex_);
  record.id = records_.empty() ? 1 : records_.back().id + 1;
  record.time = parts_.utc_now();
  record.outcome = FrameOutcome::kUnknown;
  record.words = unknown_words(record, "cellcald ended before an answer came");
  std::vector<FrameRecord> next = records_;
  next.push_back(record);
  if (next.size() > kMostFrameRecords) next.erase(next.begin());
  store(next);
  records_ = std::move(next);
}

void FrameStation::note_after(FrameRecord& record) {
  const std::lock_guard lock(mutex_);
  records_.back() = record;
  try {
    store(records_);
  } catch (const FrameNotSent& error) {
    // The disk holds 'unknown' and the old values; the result is reported nevertheless.
    record.words += fmt::format(". Not on disk: {}", error.what());
    records_.back() = record;
  }
}

std::string to_string(const FrameName& name) {
  return fmt::format("{}[{}]", name.kind == EkiFrameKind::kTool ? "TOOL_DATA" : "BASE_DATA",
                     name.number);
}

std::optional<FrameName> frame_name(std::string_view text) {
  FrameName name;
  if (text.starts_with("BASE_DATA[")) {
    name.kind = EkiFrameKind::kBase;
  } else if (!text.starts_with("TOOL_DATA[")) {
    return std::nullopt;
  }
  text.remove_prefix(std::string_view("TOOL_DATA[").size());
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, name.number);
  if (error != std::errc() || end + 1 != last || *end != ']' || name.number < 1 ||
      name.number > kMostNumber)
    return std::nullopt;
  return name;
}

std::string krl_text(const EkiFrameValues& values) {
  const auto& v = values;
  return fmt::format("{{X {:.4f},Y {:.4f},Z {:.4f},A {:.5f},B {:.5f},C {:.5f}}}", v[0], v[1], v[2],
                     v[3], v[4], v[5]);
}

std::string frames_to_json(const std::vector<FrameRecord>& records) {
  const json all{{"format", kFormat}, {"frames", list(object(record_fields())).to(records)}};
  return all.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::vector<FrameRecord> frames_from_json(const std::string& text, const std::string& file) {
  const json all = calib::parse_json(text);
  if (!all.is_object() || all.value("format", json()) != kFormat)
    throw calib::FileError(file, fmt::format(": is not {}", kFormat));
  auto records = list(object(record_fields())).from(JsonReader(all, file).at("frames"));
  for (std::size_t i = 0; i < records.size(); ++i)
    if (records[i].id <= (i == 0 ? 0 : records[i - 1].id))
      throw calib::FileError(
          file, fmt::format(".frames[{}].id: must be above the one before, and at least 1", i));
  return records;
}

std::string not_configured_words() {
  return "setting frames is off. Set backend = \"eki\" and [eki] write_frames = true in "
         "cellcald.toml, install the files that 'cellcal kuka-files' then writes, and cold start "
         "the controller; or copy the lines of 'cellcal frames' by hand";
}

std::string no_position_words() {
  return "the arm's position is available over EKI only (backend = \"eki\"), outside a session. "
         "Type the axis angles that the pendant shows";
}

std::string position_words(const drivers::EkiPosition& position) {
  using drivers::EkiPositionTrouble;
  switch (position.trouble) {
    case EkiPositionTrouble::kNoConnection:
      return no_connection_words(position.peer, position.detail);
    case EkiPositionTrouble::kNoState: return no_state_words(position.peer);
    case EkiPositionTrouble::kInSession: return kInSessionWords;
    case EkiPositionTrouble::kMoves: return kMovesWords;
    case EkiPositionTrouble::kClosed: return kClosedWords;
    case EkiPositionTrouble::kNotAStream: return kNotAStreamWords;
    case EkiPositionTrouble::kNone: break;
  }
  return {};
}

std::string not_sent_words(const FrameName& name, const EkiFrameResult& result) {
  return fmt::format("{}: not set: {}", to_string(name), why_words(result));
}

std::string why_words(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kRefused ? refusal_words(result.refusal)
                                             : trouble_words(result);
}

std::string unknown_words(const FrameRecord& record, const std::string& why) {
  return fmt::format(
      "{}: result unknown: {}. Read it on the pendant, or 'cellcal frames --restore {}' reads it "
      "and sets the old values. Old: {}; sent: {}",
      to_string(record.name), why, record.id, krl_text(record.before), krl_text(record.sent));
}

std::string outcome_words(const FrameRecord& record, const EkiFrameResult& result) {
  switch (record.outcome) {
    case FrameOutcome::kSet:
      return fmt::format(
          "{} set to {}, read back as sent. It was {}. Select the programs that use it again; "
          "'cellcal frames --restore {}' sets the old values",
          to_string(record.name), krl_text(record.sent), krl_text(record.before), record.id);
    case FrameOutcome::kDiffers:
      return fmt::format(
          "{}: {} sent, {} read back. Compare it on the pendant before the arm moves. It was {}",
          to_string(record.name), krl_text(record.sent),
          krl_text(record.read_back.value_or(drivers::EkiFrameValues{})), krl_text(record.before));
    case FrameOutcome::kRefused:
    case FrameOutcome::kNotSent: return not_sent_words(record.name, result);
    case FrameOutcome::kUnknown: break;
  }
  return unknown_words(record, trouble_words(result));
}

}  // namespace cellcal::daemon
