#pragma once
// The touches of a session that chooses as it goes: where each goes follows from what those before
// it have shown.

#include <memory>
#include <optional>
#include <vector>

#include "calib/plan/online.h"

namespace cellcal::calib {

struct CourseOptions {
  PlanOptions plan;
  Goal goal;
};

class Course {
 public:
  /// `made`: touches of the same session before it was interrupted. Throws as Online's constructor.
  Course(const Cell& cell, const CourseOptions& options, const std::vector<Touch>& made);
  ~Course();
  Course(Course&&) noexcept;
  Course& operator=(Course&&) noexcept;

  /// The next touch with its way from where the arm is; empty once done. Offered again until
  /// touched() or failed() is called. `in_contact`: the tip touches a sphere; the first waypoint
  /// then leads straight away from it. Throws PlanError where the arm stands so that no clear way
  /// leads out: the operator has to jog it.
  std::optional<PlannedTouch> next(const JointVector& from, bool in_contact);
  /// Throws IdentifyError where all touches together determine nothing.
  void touched(const Touch& touch);
  void failed();
  std::vector<JointVector> way_home() const;

  const Progress& progress() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
