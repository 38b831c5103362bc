#pragma once
// A session's evidence goes to the journal.

#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"

namespace cellcal::daemon {

class JournalRecorder final : public Recorder {
 public:
  JournalRecorder(Journal& journal, std::int64_t session, Backend& backend)
      : journal_(journal), session_(session), backend_(backend) {}

  void record(const RecordPlan& plan) override { journal_.record(session_, plan); }
  void record(const RecordReading& reading) override { journal_.record(session_, reading); }
  void record(const RecordTouch& touch) override;
  void record(const RecordEnd& end) override;
  void check() override { journal_.check(); }
  void note(const std::string& utc, const std::string& words) override;
  void note(const RecordChange& change) override { journal_.note(session_, change); }
  void note(const RecordContact& contact) override { journal_.note(session_, contact); }

 private:
  Journal& journal_;
  std::int64_t session_;
  Backend& backend_;
};

}  // namespace cellcal::daemon
