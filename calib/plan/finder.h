#pragma once
// Finding spheres whose places are only roughly known, by touching: from a rough centre, or from a
// box to search, to a centre that touches can be planned on.
//
// A sphere is approached along straight lines. Each line begins outside of every place where the
// sphere may be, is clear of everything else, and ends where the tool's shaft might come near a
// sphere that the tip has passed. The next line is the one that, as far as the arm can be led along
// it, most likely meets the sphere, and, once it was met, that tells most about its centre. What is
// met is measured as any touch, and counts as one; a line that meets nothing rules places out.
//
// Found: at least six touches (the estimate begins with five of each sphere), the centre within
// kFoundSigmaM (1 sigma, any direction) if the nominal arm is wrong by kArmSigmaM, and no touch off
// the fitted sphere by more than kOffM.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

inline constexpr double kFoundSigmaM = 0.0025;

class Finder {
 public:
  /// Finds spheres without a centre, or `all`. `made`: touches of the same session so far. Throws
  /// PlanError where a sphere has neither centre nor box.
  Finder(const Cell& cell, const PlanOptions& options, bool all, const std::vector<Touch>& made);
  ~Finder();
  Finder(Finder&&) noexcept;
  Finder& operator=(Finder&&) noexcept;

  bool done() const;
  /// The next line with its way from `from`; empty once all are found. Offered again until
  /// touched(), missed() or failed() is called. Throws PlanError where a sphere is not found, with
  /// what was tried.
  std::optional<PlannedTouch> next(const JointVector& from);
  void touched(const Touch& touch);
  /// The line met nothing.
  void missed();
  /// The line could not be searched; it says nothing.
  void failed();

  /// Whether next() leads straight out of where the sphere that is sought may be, or is in contact.
  bool leads_out(const JointVector& from) const;

  /// Whether `at` is clear of all, and of wherever a sphere may be.
  bool stands_clear(const JointVector& at) const;
  /// Whether these moves from `from` are clear of all but the spheres that are still to be found.
  bool is_clear_but_for_sought(const JointVector& from, const std::vector<JointVector>& way) const;

  /// The cell with its spheres where they were found, or are believed to be.
  const Cell& located() const;
  /// The sphere that is being found, index into the cell.
  std::optional<std::size_t> seeking() const;
  /// From where the last search ended to a posture from which another Finder can begin, whatever it
  /// knows; empty where none was made, or no clear way leads there.
  std::vector<JointVector> way_home() const;
  /// Touches still to be made, as usual; none once all are found, else at least one.
  int touches_left() const;
  /// "finding S2: 2 touches, within 8 mm"; empty once all are found.
  std::string words() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
