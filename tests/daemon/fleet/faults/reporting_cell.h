#pragma once
// A cell with a real journal and the real publisher, and a record of what it put into that journal.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/tasks/options.h"
#include "tests/daemon/plant/line/cell_line.h"

namespace cellcal::daemon::fleet::testing {

/// One fact as the journal was given it.
struct ReportedFact {
  std::string kind;
  std::int64_t session = 0;
  std::string time;  ///< of the cell's clock; empty: the journal's own

  bool is_result() const { return kind != "phase" && kind != "touch" && kind != "health"; }
};

/// All of one cell; that with number n stands at n - 1.
struct Truth {
  std::string cell, journal;
  std::vector<ReportedFact> facts;
};

/// Any thread, but one at a time connects.
class ReportingCell {
 public:
  ReportingCell(std::filesystem::path folder, std::string name, unsigned seed);
  ~ReportingCell();
  ReportingCell(const ReportingCell&) = delete;
  ReportingCell& operator=(const ReportingCell&) = delete;

  /// Its line, in the network of the calling thread.
  void connect(const std::string& host, std::uint16_t port);
  /// The daemon ends in order and begins again; not connected.
  void restart();
  /// What waits, and how its line stands.
  std::string words();

  /// A session, or something beside it: 1 to some 20 facts.
  void work();
  /// What a cell tells of so many days, on its clock: a session of 40 touches with a calibration each day, three checks, health every
  /// ten minutes. Its daemon runs, and has no line.
  void work_offline(double days);
  /// From now on its clock is so much ahead of this computer's.
  void set_clock(double ahead_s);

  /// Of what waits, the oldest.
  std::vector<plant::Fact> waiting(std::size_t most);
  std::int64_t waiting_rows();
  Truth truth();

 private:
  void open();
  std::string now() const;
  void note(const char* kind, std::int64_t session, const std::string& time);
  void session(SessionKind kind, std::size_t touches, bool calibration);
  void report(const plant::FactBody& body);

  std::filesystem::path folder_;
  std::string name_;
  std::minstd_rand random_;
  std::mutex mutex_;
  double ahead_s_ = 0.0;
  std::int64_t calibrated_ = 0;  ///< session of the newest calibration
  std::unique_ptr<Journal> journal_;
  std::shared_ptr<const Reporter> alone_;  ///< while there is no line
  std::unique_ptr<daemon::testing::CellLine> publisher_;
  std::vector<ReportedFact> facts_;
};

}  // namespace cellcal::daemon::fleet::testing
