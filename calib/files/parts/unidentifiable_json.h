#pragma once
// What touches do not decide as calibration files hold it, and parameters by their names.

#include <nlohmann/json.hpp>

#include "calib/model/parameter_key.h"
#include "calib/result/unidentifiable.h"
#include "calib/syntax/json_reader.h"

namespace cellcal::calib {

/// The parameter that a name in a file stands for. Throws FileError where the cell has none.
ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item);

nlohmann::ordered_json unidentifiable_to_json(const Cell& cell,
                                              const UnidentifiableDirection& direction);
/// Of a file without kinds, and of a kind that this version does not know, the words are kept
/// (UnidentifiableKind::kRecorded). Throws FileError.
UnidentifiableDirection unidentifiable_from_json(const Cell& cell, const JsonReader& item);

}  // namespace cellcal::calib
