#pragma once
// One run: a session with one fault at one instant, and the judgement of its result.
//
// Correct or reported, without exception:
//   - every touch on disk agrees with the emulated truth within its stated uncertainty;
//   - a session that did not reach its end reports its failure, never 'no contact' and never a
//     plain time-out;
//   - the arm rests within the dead-man time of the error, or of the fault itself if a device is
//     silent or without power permanently, and stays at rest, also when the line recovers;
//   - if the replies arrive, no axis was commanded beyond its speed, nor out of rest beyond its
//     acceleration (RSI);
//   - afterwards, repaired, newly connected adapters refuse to move before they are referenced;
//   - data on disk before the fault is unchanged to the last bit, and the session can be resumed
//     from the disk and completed, with correct touches.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "faults.h"
#include "session.h"

namespace cellcal::faults {

/// An interval of the session without faults in which a fault of this phase may begin.
struct Stretch {
  TouchPhase phase{};
  const char* which = "";    ///< if a phase occurs more than once: the fast or a slow search
  Duration from{}, until{};  ///< since power on; equal: exactly this instant
};

/// The session without faults.
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
  std::vector<std::string> violations;  ///< violated requirements
  int interruptions = 0;                ///< harmless ones, as counted by the session
  double worst_m = 0.0;                 ///< distance of a touch from the truth
  double rest_s = 0.0;                  ///< from the error, or a permanent fault, to rest
  double deepest_m = 0.0;               ///< of the tip in a sphere, whatever the arm reported
};

/// Requirements of the judgement. Tests disable or falsify single ones, to verify that the matrix
/// detects it.
struct Expectation {
  /// One sigma of a touch, as the cell file states it.
  double touch_m = 0.03e-3;
  /// Added to the emulated truth before the comparison.
  double truth_off_m = 0.0;
  /// From the dead man's message to rest: the ramp from transit or search speed, and five time
  /// constants of the arm.
  double ramp_s = 0.75, search_ramp_s = 0.2;
  /// Way of a search until the controller stops by itself.
  double deepest_m = 4e-3;
  /// The instant of the fault is checked against the session's own record.
  bool check_phase = true;
  /// Maximum number of harmless interruptions after which the session continues by itself.
  int retries = 0;
  /// Likewise for delays of this computer; default as in a daemon.
  daemon::BusyRepeats repeats{};
};

class Matrix {
 public:
  /// Plans, and runs the session without faults once per interface. Journals are kept in `folder`.
  Matrix(const std::filesystem::path& cell_file, std::filesystem::path folder, std::uint64_t seed,
         Expectation expectation = {});

  const Reference& reference(Wire wire);
  /// `number` separates the draws of one fault from those of another.
  Verdict run(Wire wire, const Fault& fault, const Stretch& stretch, std::uint64_t number);

 private:
  struct Run;
  double distance_from_truth_m(const FaultyCell& cell, const calib::Touch& touch) const;
  const Job& job(Wire wire);
  void judge_touches(Run& run, const std::vector<calib::Touch>& touches, const char* when);
  void judge_ending(Run& run);
  void judge_depth(Run& run);
  double longest_to_rest_s(const Run& run) const;
  void judge_rest(Run& run);
  void judge_reconnection(Run& run);
  void judge_resumption(Run& run);

  std::filesystem::path cell_file_;
  std::map<Wire, Job> jobs_;
  std::filesystem::path folder_;
  std::uint64_t seed_;
  Expectation expectation_;
  std::map<Wire, Reference> references_;
};

}  // namespace cellcal::faults
