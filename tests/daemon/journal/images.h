#pragma once
// Journals as left by a crash, a faulty disk or another program.

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "daemon/journal/journal.h"

namespace cellcal::daemon::testing {

inline calib::Touch touch_at(double angle_rad) {
  calib::Touch touch;
  touch.joint_rad = {angle_rad, -angle_rad};
  touch.target = "S1";
  touch.time = "2026-01-01T00:00:00.000Z";
  return touch;
}

/// One session with this many touches, each with its readings and a note.
inline std::int64_t fill(Journal& journal, std::size_t touches) {
  const std::int64_t id =
      journal.begin({"/c/cell.toml", std::string(3000, 'c'), "/c/r.toml", "robot", "{}"}, "t0");
  journal.record(id, RecordPlan{"hash", touches});
  for (std::size_t i = 0; i < touches; ++i) {
    journal.note(id, "t1", "slow search -> recording");
    RecordReading reading;
    reading.touch = i;
    reading.reading.contact_rad = {0.1, -0.1};
    journal.record(id, reading);
    reading.reading.slow = true;
    reading.reading.along_m = 0.001 * static_cast<double>(i);
    journal.record(id, reading);
    journal.record(id, RecordTouch{i, touch_at(0.1 + static_cast<double>(i))});
  }
  return id;
}

/// The files on disk, even while a daemon writes to them: the state after a crash.
inline void copy_journal(const std::filesystem::path& from, const std::filesystem::path& to) {
  for (const char* suffix : {"", "-wal", ".head"}) {
    std::filesystem::path source = from, copy = to;
    source += suffix;
    copy += suffix;
    std::filesystem::remove(copy);
    if (std::filesystem::exists(source)) std::filesystem::copy_file(source, copy);
  }
}

/// All content of a journal; throws if it is refused.
inline std::string all_of(const std::filesystem::path& path) {
  Journal journal(path);
  std::ostringstream all;
  all.precision(17);
  for (const SessionRecord& listed : journal.sessions()) {
    const auto record = journal.session(listed.id);
    if (!record) throw JournalError("a session is listed and not there");
    all << record->id << record->started << record->ended << to_string(record->state)
        << to_string(listed.state) << record->inputs.cell_name << record->inputs.cell_text
        << record->inputs.robot_name << record->inputs.robot_text << record->inputs.options
        << record->plan_hash << record->planned << record->touches << record->failure
        << record->calibration;
    for (const calib::Touch& touch : journal.touches(record->id)) {
      for (const double angle : touch.joint_rad) all << angle << ' ';
      all << touch.target << touch.time << touch.sigma_m << touch.radius_m << touch.spread_m;
    }
    for (const std::string& event : journal.events(record->id)) all << event;
    for (const RecordReading& one : journal.readings(record->id))
      all << one.touch << one.reading.slow << one.reading.along_m;
    all << journal.readings(record->id).size();
  }
  return all.str();
}

inline void flip_bit(const std::filesystem::path& path, std::uintmax_t bit) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(bit / 8));
  const char byte = static_cast<char>(file.get() ^ (1 << (bit % 8)));
  file.seekp(static_cast<std::streamoff>(bit / 8));
  file.put(byte);
}

/// The journal's reason for refusal; "" if there is none.
inline std::string error_of(const std::function<void()>& act) {
  try {
    act();
    return "";
  } catch (const JournalError& error) {
    return error.what();
  }
}

/// Reason for the refusal of a journal, or of its content; "" if there is none.
inline std::string refusal(const std::filesystem::path& path) {
  return error_of([&] { all_of(path); });
}

}  // namespace cellcal::daemon::testing
