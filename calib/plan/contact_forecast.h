#pragma once
// Where the touches so far expect a planned touch to be met: for a search that begins near the
// surface, and for judging whether one contact is enough.

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

  /// Takes those of `touches` that it has not taken yet, fit touches only. Where they determine
  /// nothing yet, nothing is expected, and the next touches are taken with them.
  void learn(std::span<const Touch> touches);
  /// One for each touch of the plan. Of a touch before `next`, and of a target that was not touched
  /// four times yet, nothing is known.
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
  double off_squares_ = 0.0;  ///< of touches before they were taken, in sigmas
  int off_count_ = 0;
};

}  // namespace cellcal::calib
