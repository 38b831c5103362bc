#pragma once
// A name that the resolver does not answer, within this program including libmosquitto.

namespace cellcal::daemon::testing {

inline constexpr const char* kBlackHole = "black-hole.example";

/// Number of pending queries.
int asked_black_hole();
/// Answers all pending queries with an error.
void answer_black_hole();

}  // namespace cellcal::daemon::testing
