#pragma once
// A routine's statements with the arguments of a call in place of its parameters: what a call sets then is what
// these lines set.

#include <optional>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

/// DEF NAME(A :IN,B :OUT): A, B.
std::vector<std::string> parameters_of(const Line& definition);

/// IF with two constants is decided. Arguments are plain numbers and enum values; any other names nothing. Empty where more than the order of the lines decides what is set: a parameter that is
/// changed or passed on, RETURN before the end, another number of arguments.
std::optional<std::vector<Line>> inlined(const std::vector<std::string>& parameters,
                                         const std::vector<Line>& body, const Line& call);

}  // namespace cellcal::daemon::krl
