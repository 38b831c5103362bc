// What a row may hold that others bring: what this journal could have written itself.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>

#include "daemon/journal/rows.h"
#include "daemon/journal/store/error.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

namespace {

enum class Holds {
  kText,    ///< UTF-8
  kName,    ///< of something: not empty, one line
  kFlag,    ///< 0 or 1
  kCount,   ///< 0 to 1e9
  kWhole,   ///< 0 or more
  kNumber,  ///< infinite: what was seen is none
  kFinite,
  kNotNegative,  ///< and finite
  kAngles,       ///< of a robot's axes, 1 to kMaxAxes
  kAnglesOrNone,
  kThree,
  kPostures,  ///< angles of one arm, any number of times; their number of axes is a column of its own
};
struct Column {
  const char* table;
  const char* name;
  Holds holds;
  bool may_be_null = false;
};

constexpr Column kColumns[] = {
    {"session", "id", Holds::kWhole},
    {"session", "started", Holds::kText},
    {"session", "ended", Holds::kText},
    {"session", "state", Holds::kName},
    {"session", "cell_name", Holds::kText},
    {"session", "cell_text", Holds::kText},
    {"session", "robot_name", Holds::kText},
    {"session", "robot_text", Holds::kText},
    {"session", "options", Holds::kText},
    {"session", "plan_hash", Holds::kText},
    {"session", "planned", Holds::kCount},
    {"session", "failure", Holds::kText},
    {"session", "calibration", Holds::kText},
    {"session", "software", Holds::kText, true},
    {"session", "origin", Holds::kText, true},
    {"session", "outcome", Holds::kText, true},
    {"touch", "number", Holds::kCount},
    {"touch", "joint_rad", Holds::kAngles},
    {"touch", "target", Holds::kName},
    {"touch", "held_out", Holds::kFlag},
    {"touch", "sigma_m", Holds::kNotNegative},
    {"touch", "radius_m", Holds::kNotNegative},
    {"touch", "tracker_m", Holds::kThree},
    {"touch", "time", Holds::kText},
    {"touch", "settled_rad", Holds::kAnglesOrNone},
    {"touch", "readings", Holds::kCount},
    {"touch", "spread_m", Holds::kNotNegative},
    {"touch", "speed_m_s", Holds::kNotNegative},
    {"touch", "tool", Holds::kText, true},
    {"touch", "turn_sigma_rad", Holds::kNotNegative, true},
    {"touch", "tracker_abc_rad", Holds::kThree, true},
    {"touch", "approach", Holds::kThree, true},
    {"touch", "temperature_c", Holds::kFinite, true},
    {"reading", "touch", Holds::kCount},
    {"reading", "number", Holds::kCount},
    {"reading", "slow", Holds::kFlag},
    {"reading", "contact_rad", Holds::kAngles},
    {"reading", "settled_rad", Holds::kAnglesOrNone},
    {"reading", "along_m", Holds::kFinite},
    {"reading", "time_sigma_s", Holds::kNumber},
    {"reading", "reaction_s", Holds::kNumber},
    {"reading", "bounces", Holds::kCount},
    {"reading", "time", Holds::kText},
    {"event", "time", Holds::kText},
    {"event", "words", Holds::kText},
    {"change", "time", Holds::kText},
    {"change", "clock_s", Holds::kNumber},
    {"change", "from_phase", Holds::kText},
    {"change", "to_phase", Holds::kText},
    {"change", "event", Holds::kText},
    {"change", "late_replies", Holds::kWhole},
    {"change", "sensor_late_s", Holds::kNumber},
    {"contact", "touch", Holds::kCount},
    {"contact", "time", Holds::kText},
    {"contact", "kind", Holds::kName},
    {"contact", "arm_id", Holds::kWhole},
    {"contact", "sequence", Holds::kWhole},
    {"contact", "number", Holds::kWhole},
    {"contact", "ticks", Holds::kWhole},
    {"contact", "confirmed_after_us", Holds::kWhole},
    {"contact", "bounces", Holds::kWhole},
    {"contact", "sense_v", Holds::kNumber},
    {"contact", "heard_s", Holds::kNumber},
    {"contact", "first_edge_s", Holds::kNumber},
    {"contact", "time_sigma_s", Holds::kNumber},
    {"contact", "lost", Holds::kWhole},
    {"compared", "words", Holds::kText},
    {"compared", "accepted", Holds::kFlag},
    {"compared", "calibration", Holds::kText},
    {"dropped", "time", Holds::kText},
    {"dropped", "rows", Holds::kWhole},
    {"activation", "time", Holds::kText},
    {"activation", "who", Holds::kText},
    {"activation", "reason", Holds::kText},
    {"interruption", "time", Holds::kText},
    {"interruption", "cause", Holds::kText},
    {"search", "time", Holds::kText},
    {"search", "target", Holds::kText},
    {"search", "axes", Holds::kCount},
    {"search", "way_rad", Holds::kPostures},
    {"search", "end_rad", Holds::kAnglesOrNone},
    {"search", "out_rad", Holds::kPostures},
};

constexpr std::size_t kMostPostures = 10'000;  ///< a way has some ten

/// Why the value is none; nothing where it is.
using Complaint = std::optional<std::string>;

Complaint of_text(const Value& value, bool is_name) {
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr) return "must be a text";
  if (!is_utf8(*text)) return "is not UTF-8";
  if (is_name && text->empty()) return "is empty";
  if (is_name && text->find_first_of("\n\r") != std::string::npos) return "has several lines";
  return std::nullopt;
}

Complaint of_whole(const Value& value, std::int64_t most) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  if (whole == nullptr) return "must be a whole number";
  if (*whole < 0 || *whole > most) return fmt::format("is {}, must be 0 to {}", *whole, most);
  return std::nullopt;
}

Complaint of_number(const Value& value, bool finite, bool not_negative) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  if (whole == nullptr && number == nullptr) return "must be a number";
  const double is = whole != nullptr ? static_cast<double>(*whole) : *number;
  if (std::isnan(is) || (finite && !std::isfinite(is))) return "must be finite";
  if (not_negative && is < 0.0) return "must not be negative";
  return std::nullopt;
}

Complaint of_doubles(const Value& value, std::size_t fewest, std::size_t most) {
  const auto* blob = std::get_if<Blob>(&value);
  if (blob == nullptr) return "must be a blob";
  const std::size_t size = blob->bytes.size();
  if (size % sizeof(double) != 0 || size < fewest * sizeof(double) || size > most * sizeof(double))
    return fmt::format("has {} bytes, must have {} to {} of 8 each", size, fewest, most);
  for (std::size_t at = 0; at < size; at += sizeof(double)) {
    double one = 0.0;
    std::memcpy(&one, blob->bytes.data() + at, sizeof one);
    if (!std::isfinite(one)) return "must be finite";
  }
  return std::nullopt;
}

Complaint complaint(const Value& value, Holds holds) {
  constexpr std::int64_t kMostCount = 1'000'000'000,
                         kAny = std::numeric_limits<std::int64_t>::max();
  switch (holds) {
    case Holds::kText:
      return of_text(value, false);
    case Holds::kName:
      return of_text(value, true);
    case Holds::kFlag:
      return of_whole(value, 1);
    case Holds::kCount:
      return of_whole(value, kMostCount);
    case Holds::kWhole:
      return of_whole(value, kAny);
    case Holds::kNumber:
      return of_number(value, false, false);
    case Holds::kFinite:
      return of_number(value, true, false);
    case Holds::kNotNegative:
      return of_number(value, true, true);
    case Holds::kAngles:
      return of_doubles(value, 1, drivers::kMaxAxes);
    case Holds::kAnglesOrNone:
      return of_doubles(value, 0, drivers::kMaxAxes);
    case Holds::kThree:
      return of_doubles(value, 3, 3);
    case Holds::kPostures:
      return of_doubles(value, 0, kMostPostures * drivers::kMaxAxes);
  }
  return std::nullopt;
}

/// One arm made them all.
class Axes {
 public:
  Complaint complaint(const Column& column, const Value& value) {
    if (column.holds != Holds::kAngles && column.holds != Holds::kAnglesOrNone) return std::nullopt;
    const std::size_t has = std::get<Blob>(value).bytes.size() / sizeof(double);
    if (has == 0) return std::nullopt;
    if (count_ == 0) count_ = has;
    if (has == count_) return std::nullopt;
    return fmt::format("has {} angles, other rows {}", has, count_);
  }

 private:
  std::size_t count_ = 0;
};

}  // namespace

void refuse_impossible(const SessionRows& rows, const std::string& from) {
  Axes axes;
  for (std::size_t i = 0; i < rows.entries.size(); ++i) {
    const RowEntry& entry = rows.entries[i];
    for (std::size_t k = 0; k < entry.names.size(); ++k) {
      const auto* column = std::ranges::find_if(kColumns, [&](const Column& one) {
        return entry.table == one.table && entry.names[k] == one.name;
      });
      const Value& value = entry.columns[k];
      // No such column is refused where the row is inserted; the session's number is another here.
      if (column == std::end(kColumns) ||
          (column->may_be_null && std::holds_alternative<std::monostate>(value)))
        continue;
      Complaint why = complaint(value, column->holds);
      if (!why) why = axes.complaint(*column, value);
      if (why)
        throw JournalError(fmt::format(
            "{}:{}: row {} of '{}': {} {}. No session has such a row: damaged or forged. "
            "Export the session again",
            from, i + 2, entry.row, entry.table, column->name, *why));
    }
  }
}

}  // namespace cellcal::daemon
