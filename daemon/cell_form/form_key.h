#pragma once
// Field of the form that a contradiction of the cell is about.

#include <string>

#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// As FormFault::key. Empty: of no single field.
std::string key_of(const calib::CellFault& fault, const CellForm& form);

}  // namespace cellcal::daemon
