#include "calib/model/long_work.h"

#include <algorithm>
#include <utility>

namespace cellcal::calib {

namespace {

/// Step of reported progress, as a share.
constexpr double kPercent = 0.01;

/// State of one thread.
struct Work {
  const Watch* watch = nullptr;
  double from = 0.0, to = 1.0;  ///< current part, as shares of the whole
  PlanStep step = PlanStep::kReach;
  double reported = -1.0;
};
thread_local Work work;

}  // namespace

Watch::Watch(std::function<bool()> cancelled, std::function<void(const WorkDone&)> report)
    : cancelled_(std::move(cancelled)), report_(std::move(report)), outer_(work.watch) {
  work = {this};
}
Watch::~Watch() { work = {outer_}; }

const Watch* Watch::current_watch() { return work.watch; }

HelperScope::HelperScope(const Watch* current_watch) { work = {current_watch}; }
HelperScope::~HelperScope() { work = {}; }

bool is_cancelled() { return work.watch != nullptr && work.watch->cancelled(); }

void poll_cancelled() {
  if (is_cancelled()) throw Cancelled{};
}

Part::Part(PlanStep step, double from, double to)
    : from_(work.from), to_(work.to), step_(std::exchange(work.step, step)) {
  const double all = to_ - from_;
  work.from = from_ + from * all;
  work.to = from_ + to * all;
  report_progress(0.0);
}

Part::~Part() {
  work.from = from_;
  work.to = to_;
  work.step = step_;
}

void report_progress(double share) {
  if (work.watch == nullptr || !work.watch->report_) return;
  const double all = work.from + std::clamp(share, 0.0, 1.0) * (work.to - work.from);
  if (all < work.reported + kPercent) return;
  work.reported = all;
  work.watch->report_({work.step, all});
}

}  // namespace cellcal::calib
