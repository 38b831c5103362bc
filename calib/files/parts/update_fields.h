#pragma once
// What an updated calibration stands on, as its file has it.

#include "calib/result/update.h"
#include "calib/syntax/json_fields.h"

namespace cellcal::calib {

fields::Table<UpdateOrigin> update_fields();

}  // namespace cellcal::calib
