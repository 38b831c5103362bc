#pragma once
// Writes a session's evidence to the journal.

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"
#include "daemon/service/status.h"
#include "daemon/session/state.h"

namespace cellcal::calib {
class ArmModel;
}

namespace cellcal::daemon {

class JournalRecorder final : public Recorder {
 public:
  /// Reports stored in the transaction of the session's end; may be empty. Called on the recorder's thread.
  using EndReports = std::function<std::vector<Report>(std::int64_t session, const RecordEnd& end)>;
  /// `arm`: nominal model for the tips of published touches; null: published without tips.
  JournalRecorder(Journal& journal, std::int64_t session, Backend& backend,
                  std::shared_ptr<const calib::ArmModel> arm = {}, EndReports end_reports = {})
      : journal_(journal),
        session_(session),
        backend_(backend),
        arm_(std::move(arm)),
        end_reports_(std::move(end_reports)) {}

  void record(const RecordPlan& plan) override { journal_.record(session_, plan); }
  void record(const RecordReading& reading) override { journal_.record(session_, reading); }
  void record(const RecordTouch& touch) override;
  void record(const RecordSearch& search) override {
    journal_.record(session_, search, backend_.utc_now());
  }
  void record(const RecordEnd& end) override;
  void check() override { journal_.check(); }
  void note(const std::string& utc, const std::string& words) override;
  void note(const RecordChange& change) override { journal_.note(session_, change); }
  void note(const RecordContact& contact) override { journal_.note(session_, contact); }
  void note(const RecordCause& cause) override { journal_.note(session_, cause); }

 private:
  Journal& journal_;
  std::int64_t session_;
  Backend& backend_;
  std::shared_ptr<const calib::ArmModel> arm_;
  EndReports end_reports_;
};

}  // namespace cellcal::daemon

namespace cellcal::calib {
class ArmModel;
}

namespace cellcal::daemon {

// Publication of touches: each once, when it is on disk and its residual is known, at the latest when the
// next touch is made or the session ends.

/// TCP of the touch by the nominal model [m, base frame]; none where its joint count differs from the arm's.
std::optional<std::array<double, 3>> nominal_tip(const calib::ArmModel& arm,
                                                 const calib::Touch& touch);

class TouchPublication {
 public:
  TouchPublication() = default;
  /// `known`: number of touches of the session published before.
  TouchPublication(std::int64_t session, const calib::Cell& cell, std::size_t known);

  /// The touch to publish now, or null. At most one per call: to be called after every step.
  std::shared_ptr<const MadeTouch> next(const State& state,
                                        const std::vector<calib::Touch>& touches);

 private:
  std::int64_t session_ = 0;
  std::shared_ptr<const calib::ArmModel> arm_;
  std::size_t published_ = 0;
};

}  // namespace cellcal::daemon
