#pragma once
// Plans for a cell with a positioner: the same choice of touches, among candidates at several
// settings of its axes. The axes turn only while the arm waits at the start of the plan.

#include <memory>
#include <vector>

#include "calib/plan/planned_touch.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

/// True within what a positioner's axes are left at.
bool stands_at(const std::vector<double>& angles, const std::vector<double>& setting);
/// Angles of axes at rest. An axis that rests at the end of its range, and by its encoder beyond, is at the end.
std::vector<double> resting_at(const Robot& robot, const std::vector<double>& angles);

/// The cell with the positioner at these angles: all places in the base frame, how far off they may be
/// there (64b), and no positioner.
Cell at_setting(const Cell& cell, const std::vector<double>& positioner_rad);

/// Throws PlanError if the positioner on its way from one setting to the other meets the arm at `rest`.
void require_clear_turn(const Cell& cell, const std::vector<double>& from,
                        const std::vector<double>& to, const JointVector& rest);

/// Where the arm waits while the positioner turns: clear of all that it carries, wherever that is. The middle
/// posture if none tried is; require_clear_turn() then refuses.
JointVector waiting_posture(const Cell& cell);

/// The pool of a still cell's targets that can be touched; the others become obstacles. Null: none can, or the arm
/// cannot rest. `refused`: the reason for each of the others, the last one of null.
std::unique_ptr<Pool> pool_of_touchable(Cell& cell, const PlanOptions& options, int per_target,
                                        Kinds kinds, const JointVector& rest,
                                        std::vector<PlanError>& refused);

/// Angles spread over the axes' limits, the first nearest to zero.
std::vector<std::vector<double>> settings_of(const Robot& robot);

/// As make_plan(). Targets on the floor are touched at the first setting that lets them. Throws PlanError also
/// where the resting arm is in the way of the turning positioner.
Plan make_positioner_plan(const Cell& cell, const PlanOptions& options, const JointVector& from);

}  // namespace cellcal::calib
