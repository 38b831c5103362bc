#pragma once
// A name that the resolver does not answer, for the whole of this program: libmosquitto asks for it, too.

namespace cellcal::daemon::testing {

inline constexpr const char* kBlackHole = "black-hole.example";

/// How many ask for it now.
int asked_black_hole();
/// Those that ask are told that there is no such name.
void answer_black_hole();

}  // namespace cellcal::daemon::testing
