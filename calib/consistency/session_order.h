#pragma once
// Touches in the order in which they were made, and a session in two parts: before something in it
// changed, and after.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
