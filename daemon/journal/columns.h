#pragma once
// Columns of the tables whose rows have checksums, in their order: the tables are made of them (prepare.cc), and imported
// rows are checked by them (rows.cc). Each table begins with the number of its session.
//
// A later version appends columns that are NULL in earlier rows, or adds tables: the checksums of earlier rows stay valid.

namespace cellcal::daemon {

/// Values of a column.
enum class Holds {
  kText,    ///< UTF-8
  kName,    ///< a name: not empty, one line
  kFlag,    ///< 0 or 1
  kCount,   ///< 0 to 1e9
  kWhole,   ///< 0 or more
  kNumber,  ///< infinite: recorded NaN
  kFinite,
  kNotNegative,  ///< and finite
  kAngles,       ///< of a robot's axes, 1 to kMaxAxes; doubles, little endian, as in all blobs
  kAnglesOrNone,
  kThree,
  kPostures,  ///< angles of one arm, any number of postures; the number of axes is another column
};
/// Stored where no value is given: never so, NULL, '' or 0.
enum class Absent { kNever, kNull, kEmpty };
struct Column {
  const char* table;
  const char* name;
  Holds holds;
  Absent absent = Absent::kNever;
};

inline constexpr Column kColumns[] = {
    {"session", "id", Holds::kWhole},
    {"session", "started", Holds::kText},
    {"session", "ended", Holds::kText, Absent::kEmpty},
    {"session", "state", Holds::kName},
    {"session", "cell_name", Holds::kText},
    {"session", "cell_text", Holds::kText},
    {"session", "robot_name", Holds::kText},
    {"session", "robot_text", Holds::kText},
    {"session", "options", Holds::kText},
    {"session", "plan_hash", Holds::kText, Absent::kEmpty},
    {"session", "planned", Holds::kCount, Absent::kEmpty},
    {"session", "failure", Holds::kText, Absent::kEmpty},
    {"session", "calibration", Holds::kText, Absent::kEmpty},
    {"session", "software", Holds::kText},               // that began it
    {"session", "origin", Holds::kText, Absent::kNull},  // JSON, of an imported one
    {"session", "outcome", Holds::kText,
     Absent::kNull},  // JSON, cellcal.outcome/1; both written with the end
    {"session", "document", Holds::kText,
     Absent::kNull},  // JSON of a check, a qualification, found spheres or a failure
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
    {"touch", "tool", Holds::kText},
    {"touch", "turn_sigma_rad", Holds::kNotNegative},
    {"touch", "tracker_abc_rad", Holds::kThree, Absent::kNull},
    {"touch", "approach", Holds::kThree, Absent::kNull},
    {"touch", "temperature_c", Holds::kFinite, Absent::kNull},
    {"touch", "load", Holds::kName, Absent::kNull},  // held
    {"touch", "positioner_rad", Holds::kAngles, Absent::kNull},
    {"reading", "touch", Holds::kCount},
    {"reading", "number", Holds::kCount},  // 0: the fast search
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
    {"change", "clock_s", Holds::kNumber},  // session's clock
    {"change", "from_phase", Holds::kText},
    {"change", "to_phase", Holds::kText},
    {"change", "event", Holds::kText},
    {"change", "late_replies", Holds::kWhole},    // as the controller had counted them
    {"change", "sensor_late_s", Holds::kNumber},  // worst delivery of the sensor's bytes
    {"contact", "touch", Holds::kCount},          // in hand
    {"contact", "time", Holds::kText},
    {"contact", "kind", Holds::kName},  // trip, contact, revoked, release
    {"contact", "arm_id", Holds::kWhole},
    {"contact", "sequence", Holds::kWhole},  // of the frame, modulo 256
    {"contact", "number", Holds::kWhole},    // the sensor's; 0: a trip
    {"contact", "ticks", Holds::kWhole},     // first edge, sensor's clock, 0.5 us, modulo 2^32
    {"contact", "confirmed_after_us", Holds::kWhole},
    {"contact", "bounces", Holds::kWhole},
    {"contact", "sense_v", Holds::kNumber},
    {"contact", "heard_s", Holds::kNumber},       // session's clock
    {"contact", "first_edge_s", Holds::kNumber},  // session's clock, by the clock map
    {"contact", "time_sigma_s", Holds::kNumber},
    {"contact", "lost", Holds::kWhole},  // events before this one that are not here
    // The earlier calibration that a result is compared with; the newest row counts.
    {"compared", "words", Holds::kText},        // which calibration
    {"compared", "accepted", Holds::kFlag},     // a changed arm was to be accepted
    {"compared", "calibration", Holds::kText},  // JSON
    // Sessions whose raw rows were dropped.
    {"dropped", "time", Holds::kText},
    {"dropped", "rows", Holds::kWhole},  // of event, change, contact and reading
    // Calibrations that were put into use although a newer one was published.
    {"activation", "time", Holds::kText},
    {"activation", "who", Holds::kText},
    {"activation", "reason", Holds::kText},
    // Searches for spheres, written before the motion.
    {"search", "time", Holds::kText},
    {"search", "target", Holds::kText},  // '': nothing is searched, the arm goes home
    {"search", "axes", Holds::kCount},
    {"search", "way_rad", Holds::kPostures},      // from where the arm stood to the stand-off
    {"search", "end_rad", Holds::kAnglesOrNone},  // of the search; empty: none
    {"search", "out_rad", Holds::kPostures},  // from the clear point out; empty: no way is known
    // Harmless interruptions.
    {"interruption", "time", Holds::kText},
    {"interruption", "cause",
     Holds::kText},  // sensor-data-late, robot-replies-late, packets-stopped
};

}  // namespace cellcal::daemon
