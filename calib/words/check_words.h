#pragma once
// The sentences of a check, made here and nowhere else: number first, then what to do.

#include <string>
#include <vector>

#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// "holds: TCP shift 0.03 +- 0.08 mm (k=2)", "does not hold: ..."
std::string verdict_words(const TcpCheck& check);
/// What changed and what to do; empty where it holds.
std::string change_words(const TcpCheck& check);
/// "tool shifted by 0.31 +- 0.08 mm (k=2) on the flange"
std::string words(const Explanation& explanation);
/// What to do about a change; empty of none.
std::string remedy_words(const Explanation& change);
/// All of it, a line each: the verdict, what to do, spheres that were not found, every explanation with its
/// likelihood, what such a check finds.
std::vector<std::string> words(const TcpCheck& check);

}  // namespace cellcal::calib
