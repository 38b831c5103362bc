#pragma once
// One run: a session with one fault at one instant, and the judgement of what came of it.
//
// Right or named, nothing else:
// - every touch on disk agrees with the emulated truth within its stated uncertainty;
// - a session that did not reach its end names its failure in words, never 'no contact' and never
//   a mere time-out;
// - the arm rests within the dead-man time of the error, or of the fault itself where something
//   fell silent or lost its power for good, and stays at rest, also when the line comes back;
// - where the replies arrive no axis was commanded beyond its speed, nor out of rest beyond its
//   acceleration (RSI);
// - behind it, mended, freshly connected adapters refuse to move before they are referenced;
// - what was on disk before the fault is on disk to the last bit, and the session can be resumed
//   from the disk and comes to its end, touches right.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "faults.h"
#include "session.h"

namespace cellcal::faults {

/// A stretch of the session without faults in which a fault of this phase may begin.
struct Stretch {
  TouchPhase phase{};
  const char* which = "";    ///< where a phase comes more than once: the fast or a slow search
  Duration from{}, until{};  ///< since power on; equal: this very instant
};

/// What a session without faults does.
struct Reference {
  std::vector<Stretch> stretches;
  std::vector<calib::Touch> touches;
  Duration lasts{};
};

enum class Outcome { kMeasured, kNamed, kViolation };

struct Verdict {
  Outcome outcome = Outcome::kMeasured;
  std::string name;                     ///< of the error
  std::string words;                    ///< of the error
  std::vector<std::string> violations;  ///< what was promised and not kept
  int interruptions = 0;                ///< harmless ones, as the session counted them
  double worst_m = 0.0;                 ///< distance of a touch from the truth
  double rest_s = 0.0;                  ///< error or, where something was severed, fault to rest
};

/// What the judgement is held to. Tests turn single ones off or against the truth, to see that the
/// matrix notices.
struct Expectation {
  /// One sigma of a touch, as the cell file states it.
  double touch_m = 0.03e-3;
  /// Added to the emulated truth before the comparison.
  double truth_off_m = 0.0;
  /// From the dead man's word to rest: the ramp from transit speed, or from that of a search, and
  /// five time constants of the arm behind its setpoint.
  double ramp_s = 0.75, search_ramp_s = 0.2;
  /// The instant of the fault is looked up in the session's own record.
  bool check_phase = true;
  /// The session may go on by itself from so many harmless interruptions.
  int retries = 0;
  /// Likewise where this computer was late; by default as a daemon begins them.
  daemon::BusyRepeats repeats{};
};

class Matrix {
 public:
  /// Plans, and runs the session without faults once per wire. Journals are kept in `folder`.
  Matrix(const std::filesystem::path& cell_file, std::filesystem::path folder, std::uint64_t seed,
         Expectation expectation = {});

  const Reference& reference(Wire wire);
  /// `number` separates the draws of one fault from those of another.
  Verdict run(Wire wire, const Fault& fault, const Stretch& stretch, std::uint64_t number);

 private:
  struct Run;
  double distance_from_truth_m(const FaultyCell& cell, const calib::Touch& touch) const;
  void judge_touches(Run& run, const std::vector<calib::Touch>& touches, const char* when);
  void judge_ending(Run& run);
  double longest_to_rest_s(const Run& run) const;
  void judge_rest(Run& run);
  void judge_reconnection(Run& run);
  void judge_resumption(Run& run);

  Job job_;
  std::filesystem::path folder_;
  std::uint64_t seed_;
  Expectation expectation_;
  std::map<Wire, Reference> references_;
};

}  // namespace cellcal::faults
