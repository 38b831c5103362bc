#pragma once
// Predicts the contacts of planned touches from those made so far: for starting a search near the
// surface, and for deciding whether one contact is sufficient.

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calib/estimate/incremental_estimate.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

class ContactForecast {
 public:
  explicit ContactForecast(Cell cell) : cell_(std::move(cell)) {}

  /// Includes those of `touches` not yet included, fit touches only. While they do not determine an
  /// estimate, nothing is predicted, and they are retried with the next touches.
  void learn(std::span<const Touch> touches);
  /// One entry per touch of the plan. Unknown for touches before `next`, and for a target with
  /// fewer than four touches.
  std::vector<ExpectedContact> of(const Plan& plan, std::size_t next) const;

 private:
  void take(const Touch& touch);
  void begin();
  std::ptrdiff_t made(const std::string& target) const;
  double misfit() const;

  Cell cell_;
  std::size_t learnt_ = 0;
  std::vector<Touch> fit_;
  std::optional<IncrementalEstimate> running_;
  double off_squares_ = 0.0;  ///< of touches before their inclusion, in sigmas
  int off_count_ = 0;
};

}  // namespace cellcal::calib
