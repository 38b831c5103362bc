#pragma once
// The arm and its tool as a cell file describes them, against what no arm can be or do; part of cell_check.h.

#include <vector>

#include "calib/plan/cell_check.h"

namespace cellcal::calib {

/// Rated payload [kg] as KUKA's model name states it ("KR 16 R1610-2": 16, "KR 150 L110": 110). 0: not known.
double rated_payload_kg(const Robot& robot);

void look_at_load(const Cell& cell, std::vector<CellFault>& faults);
void look_at_column(const Cell& cell, std::vector<CellFault>& faults);
void look_at_tool(const Cell& cell, std::vector<CellFault>& faults);
/// At rest the arm can neither stand in itself nor in the floor, and it reaches some target: where it would not, its
/// description is wrong. Takes the place of those `faults` that this explains; says nothing where others are refused.
void look_at_description(const Cell& cell, std::vector<CellFault>& faults);

}  // namespace cellcal::calib
