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

/// The statements of `body` as `call` runs them: constant arguments are put in, any other argument names nothing, IF with
/// two constants is decided. Empty where a parameter is changed or passed on, or with another number of arguments.
std::optional<std::vector<Line>> inlined(const std::vector<std::string>& parameters,
                                         const std::vector<Line>& body, const Line& call);

}  // namespace cellcal::daemon::krl
