#pragma once
// Parameters, their covariance and the frame directions as a calibration file has them: in the
// parameters' own units, matrices in the order of the parameters.

#include "calib/result/calibration.h"
#include "calib/syntax/json_fields.h"

namespace cellcal::calib {

/// "parameters"; the cell is read before.
fields::Field<Calibration> parameters_field();
/// "covariance", "frame_basis"; the parameters are read before.
fields::Field<Calibration> covariance_field();
fields::Field<Calibration> frame_basis_field();

}  // namespace cellcal::calib
