#pragma once
// Presence of a cell, retained by the broker, "cellcal.presence/1".

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/model/enum_table.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

struct Presence {
  CellName of;
  bool online = false;
  bool farewell = false;  ///< an orderly end, as opposed to a lost line
  std::string journal;
  std::int64_t number = 0;  ///< of the newest fact at the time of connection
  std::string software;
  /// Time of connection or end; of a will: time of connection. ISO 8601 UTC.
  std::string time;
  bool mock = false;  ///< emulated cell

  bool operator==(const Presence&) const = default;
};

std::string to_json(const Presence& presence);
/// Throws calib::FileError.
Presence presence_from_json(std::string_view json, const Topic& topic);

// Facts of a journal that are stored in the plant's database, "cellcal.stored/1": only then is a result
// removed from its cell. A broker's acknowledgement is not sufficient, since a killed broker loses messages
// that it had acknowledged but not saved.

struct Stored {
  CellName of;
  std::string journal;
  /// First and last, both stored; ascending. Limited to the newest: older ones were announced before.
  std::vector<std::pair<std::int64_t, std::int64_t>> numbers;

  bool has(std::int64_t number) const;
  bool operator==(const Stored&) const = default;
};

inline constexpr std::size_t kMostStoredRanges = 200;

std::string to_json(const Stored& stored);
/// Throws calib::FileError.
Stored stored_from_json(std::string_view json, const Topic& topic);

// Proposals of a plant to a cell, "cellcal.proposal/1". A proposal has no effect by itself: an operator of
// the cell, or a policy in its configuration, accepts or rejects it, and neither causes motion.

enum class ProposalKind {
  kCalibrate,  ///< the cell should be calibrated
  kCheck,      ///< the cell should be checked
  kActivate,   ///< a calibration of this cell's journal should be reactivated
  kSchedule,   ///< replacement for [schedule] of its configuration
  kPriors,     ///< tolerances for its robot file
  kWithdraw    ///< the proposal of this id is obsolete
};
constexpr const char* to_string(ProposalKind kind) { return own_name(kind); }

struct Proposal {
  CellName of;
  std::string id;  ///< a name; identifies repeated messages
  ProposalKind kind = ProposalKind::kCalibrate;
  std::int64_t session = 0;  ///< kActivate
  std::string text;          ///< kSchedule, kPriors: TOML
  std::string by, reason;
  std::string time;  ///< ISO 8601 UTC

  bool operator==(const Proposal&) const = default;
};

std::string to_json(const Proposal& proposal);
/// Throws calib::FileError.
Proposal proposal_from_json(std::string_view json, const Topic& topic);
/// The message as part of another document.
calib::fields::Json message_of(const Proposal& proposal);
Proposal proposal_in(const nlohmann::json& message, const Topic& topic);

}  // namespace cellcal::daemon::plant
