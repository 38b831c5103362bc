#pragma once
// A cell with a real journal and the real publisher, and a record of the facts in that journal.

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

/// One fact as given to the journal.
struct ReportedFact {
  std::string kind;
  std::int64_t session = 0;
  std::string time;  ///< by the cell's clock; empty: the journal's own

  bool is_result() const { return kind != "phase" && kind != "touch" && kind != "health"; }
};

/// All facts of one cell; number n has index n - 1.
struct Truth {
  std::string cell, journal;
  std::vector<ReportedFact> facts;
};

/// Thread-safe, except that connections are made one at a time.
class ReportingCell {
 public:
  ReportingCell(std::filesystem::path folder, std::string name, unsigned seed);
  ~ReportingCell();
  ReportingCell(const ReportingCell&) = delete;
  ReportingCell& operator=(const ReportingCell&) = delete;

  /// Connects in the network of the calling thread.
  void connect(const std::string& host, std::uint16_t port);
  /// Ends the daemon orderly and starts it again; not connected.
  void restart();
  /// Number of queued facts, and state of the connection.
  std::string words();

  /// A session or other facts: 1 to some 20.
  void work();
  /// Facts of this many days by its clock: a session of 40 touches with a calibration each day, three checks, health every ten
  /// minutes. Its daemon runs without a connection.
  void work_offline(double days);
  /// From now on its clock is ahead of this computer's by this.
  void set_clock(double ahead_s);

  /// The oldest queued facts.
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
  std::shared_ptr<const Reporter> alone_;  ///< without a connection
  std::unique_ptr<daemon::testing::CellLine> publisher_;
  std::vector<ReportedFact> facts_;
};

}  // namespace cellcal::daemon::fleet::testing
