#pragma once
// Reports every fact in a word.

#include <string>
#include <vector>

#include "daemon/journal/journal.h"

namespace cellcal::daemon::testing {

class PlainReporter : public Reporter {
 public:
  explicit PlainReporter(std::int64_t most = 1 << 20, std::size_t size = 1,
                         std::string address = {})
      : most_(most), fill_(size, '.'), address_(std::move(address)) {}
  std::vector<Report> session(const SessionRecord& session) const override {
    return {
        {"session", Worth::kResult,
         to_string(session.state) +
             (session.failure_kind ? std::string(" ") + to_string(*session.failure_kind) : "")}};
  }
  std::vector<Report> touch(const RecordTouch& touch) const override {
    return {{"touch", Worth::kTelemetry,
             std::to_string(touch.index) + fill_ + (touch.residual_m ? "assessed" : "")}};
  }
  std::vector<Report> change(const RecordChange& change) const override {
    return {{"phase", Worth::kTelemetry, to_string(change.change.to)}};
  }
  std::vector<Report> activation(const Activation& activation) const override {
    return {{"activation", Worth::kResult, activation.who}};
  }
  std::string address() const override { return address_; }
  bool publishes_name(const std::string& other) const override {
    return address_.empty() || other == address_;
  }
  std::int64_t most_bytes() const override { return most_; }

 private:
  std::int64_t most_;
  std::string fill_, address_;
};

/// "1 session running", one line each.
inline std::string words_of(const std::vector<WaitingReport>& rows) {
  std::string all;
  for (const WaitingReport& row : rows)
    all += std::to_string(row.number) + " " + row.report.kind + " " + row.report.body + "\n";
  return all;
}

}  // namespace cellcal::daemon::testing
