#pragma once
// Conversion of the journal's facts to bodies for the plant.

#include <functional>

#include "daemon/journal/journal.h"
#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

/// Row of a fact from elsewhere, for Journal::report().
Report report_of(const FactBody& body);
/// With another priority than usual: `worth` determines whether the outbox may drop it.
Report report_of(const FactBody& body, Worth worth);

class PlantReporter final : public Reporter {
 public:
  struct Parts {
    bool touches = false;
    std::int64_t most_bytes = 0;
    CellName name{};  ///< under which facts are written from now on
    std::vector<std::string>
        former{};  ///< "plant/cell": facts written under these are reported under that name
    std::function<void()> waits;
  };
  explicit PlantReporter(Parts parts) : parts_(std::move(parts)) {}

  std::vector<Report> session(const SessionRecord& session) const override;
  /// Predicted u95 near its touches and over the workspace.
  Report calibration(const SessionRecord& session,
                     const std::vector<calib::Touch>& touches) const override;
  std::vector<Report> touch(const RecordTouch& touch) const override;
  std::vector<Report> change(const RecordChange& change) const override;
  std::vector<Report> activation(const Activation& activation) const override;
  Report dropped(std::int64_t first, std::int64_t last, std::int64_t count) const override;
  std::string address() const override;
  bool publishes_name(const std::string& address) const override;
  std::int64_t most_bytes() const override { return parts_.most_bytes; }
  void waits() const override {
    if (parts_.waits) parts_.waits();
  }

 private:
  Parts parts_;
};

}  // namespace cellcal::daemon::plant
