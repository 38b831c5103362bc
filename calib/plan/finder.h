#pragma once
// Locates spheres with roughly known places by touching: from a rough centre, or from a search box,
// to a centre that is accurate enough for planning touches.
//
// A sphere is approached along straight lines. Each line begins outside of all its possible places,
// is clear of everything else, and ends where the tool's shaft could come close to a sphere that
// the tip has passed. The next line is the feasible one with the highest probability of contact,
// and, after the first contact, the one with the highest information on the centre. Contacts are
// measured like any touch and count as such; a line without contact excludes places.
//
// With a positioner all of this is at one setting of it, at which the arm alone moves. A linear unit
// stays near the place that is opposite to the sphere (Finder::Impl::near_it).
//
// Found: at least six touches (the estimate starts with five of each sphere), the centre within
// found_sigma_m (1 sigma, any direction) for a nominal arm with its error (arm_sigma_m), after twelve
// within Sought::enough_m(), and no touch off the fitted sphere by more than kOffSigmas of that.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/hidden.h"
#include "calib/model/touch.h"
#include "calib/plan/planned_touch.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// Of a found centre, 1 sigma: 2.5 mm, in proportion to the error of a large arm.
double found_sigma_m(double arm_sigma_m);
/// Largest sigma of a centre for touches: a search towards it passes the sphere where the true one is farther aside than the
/// radius of sphere and tip, with the probability exp(-radius^2 / (2 sigma^2)).
double most_centre_sigma_m(double radius_m);

/// True if a sphere's place is not known.
bool must_find(const Cell& cell);

class Finder {
 public:
  /// Locates spheres without a centre, or `all`. `made`: earlier touches of the same session, at any
  /// setting of the positioner. `positioner_rad`: angles at which it is now; empty: nearest to 0.
  /// Throws PlanError if a sphere has neither centre nor box.
  Finder(const Cell& cell, const PlanOptions& options, bool all, const std::vector<Touch>& made,
         std::vector<double> positioner_rad = {});

  bool done() const;
  /// The next line with its path from `from`; empty once all are found. Repeated until touched(),
  /// missed() or failed() is called. Throws PlanError if a sphere is not found, listing the
  /// attempts.
  std::optional<PlannedTouch> next(const JointVector& from);
  void touched(const Touch& touch);
  /// The line made no contact.
  void missed();
  /// The line could not be searched; no information.
  void failed();

  /// True if next() moves straight away from the possible places of the sphere being searched for,
  /// or from contact.
  bool leads_out(const JointVector& from) const;

  /// True if `at` is clear of everything, including all possible places of spheres.
  bool is_clear_at(const JointVector& at) const;
  /// True if these moves from `from` are clear of everything except the spheres still to be found.
  bool is_clear_except_sought(const JointVector& from, const std::vector<JointVector>& way) const;

  /// The cell with its spheres at their found or estimated places: at the positioner's angles, all in
  /// the base frame (at_setting), and with each in the frame of its carrier.
  const Cell& here() const;
  Cell located() const;
  const std::vector<double>& positioner_rad() const;
  /// Largest 1 sigma of a located centre, by the arm's error and its touches; `target`: index into the cell.
  double centre_sigma_m(std::size_t target) const;
  /// The sphere being searched for, index into the cell.
  std::optional<std::size_t> seeking() const;
  /// From the end of the last search to a posture from which another Finder can begin without this
  /// knowledge; empty without a search or a clear path, or if the arm is elsewhere.
  std::vector<JointVector> way_home(const JointVector& from) const;
  /// Typical number of touches remaining; 0 once all are found, otherwise at least 1.
  int touches_left() const;
  /// The sphere being sought, its touches, and within how many mm it is known; empty once all are found.
  Phrase stage() const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

}  // namespace cellcal::calib
