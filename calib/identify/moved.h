#pragma once
// A target that was knocked or crept during the session. Where it moved by less than what makes
// chi^2 or outliers stand out, the estimate puts it half-way and bends the arm a little, and
// nothing else tells; so each target's touches before and after are compared, in the order in which
// they were made. Spheres, wires and points; planes and trackers have no centre to compare.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/identify/calibration.h"
#include "calib/identify/estimate.h"
#include "calib/identify/identify.h"
#include "calib/identify/problem.h"

namespace cellcal::calib {

/// Targets, each with the touch of it that speaks most for a move after it, loudest first; from the
/// linearisation, without solving anew. No more than reasons to look closer.
std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& estimate,
                                         double chi2_per_dof);

/// Touches in the order in which they were made: by time where all have one (and as given where it
/// is the same), else as given.
std::vector<std::size_t> in_order(std::span<const Touch> touches);

/// Of more than `most` touches a share in their order, of each target's fit and check touches
/// alike; indices, rising.
std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most);

/// An id for the same target after its move, which none of the cell's has.
std::string id_after_move(const Cell& cell, const std::string& id);

/// A session in which a target stands elsewhere behind one of its touches, as one of two targets:
/// the later one within `sigma_m` of `centre_m`, or anywhere.
struct TwoPlaces {
  Cell cell;
  std::vector<Touch> touches;
  std::string later;  ///< its id
};
TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m = {},
                 double sigma_m = 0.0);

/// Looks closer at the suspects in `calibration.moved`: identifies again with the target taken as
/// two, before and after. Where these lie apart by more than both leave open, `calibration.moved`
/// holds by how much and the result is withheld for it; otherwise it is emptied. `calibration` is
/// of these touches.
void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration);

}  // namespace cellcal::calib
