#include "daemon/controller/frame_station.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/files/input_file.h"
#include "calib/model/enum_table.h"
#include "daemon/controller/frame_record.h"
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

using Rotation = std::array<double, 9>;

/// Rz(A) Ry(B) Rx(C), row-major.
Rotation rotation_of(const EkiFrameValues& frame) {
  const double a = frame[3] * kRadPerDeg, b = frame[4] * kRadPerDeg, c = frame[5] * kRadPerDeg;
  const double sa = std::sin(a), ca = std::cos(a), sb = std::sin(b), cb = std::cos(b),
               sc = std::sin(c), cc = std::cos(c);
  return {ca * cb,
          ca * sb * sc - sa * cc,
          ca * sb * cc + sa * sc,
          sa * cb,
          sa * sb * sc + ca * cc,
          sa * sb * cc - ca * sc,
          -sb,
          cb * sc,
          cb * cc};
}

/// Angle between two rotations: for an angle t the Frobenius norm of their difference is 2 sqrt(2) sin(t /
/// 2).
double turned_deg(const EkiFrameValues& from, const EkiFrameValues& to) {
  const Rotation one = rotation_of(from), other = rotation_of(to);
  double sum = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) sum += std::pow(one[i] - other[i], 2);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(sum / 8.0))) * drivers::kDegPerRad;
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

}  // namespace cellcal::daemon
