// What the cell file states of its artefacts, and is not so: diameters, certified lengths, centres.

#include <algorithm>
#include <string>

#include "calib/consistency/certified_lengths.h"
#include "calib/diagnose/mistakes.h"
#include "calib/problem/target_place.h"

namespace cellcal::calib {

namespace {

/// That all makes sense without this length and those of the same ends, and what that makes of it.
void without_length(const Asked& asked, const CertifiedLength& wrong) {
  const auto same = [&](const CertifiedLength& l) { return same_ends(l, wrong); };
  asked.ask({silenced(asked.cell, same), asked.touches, [&](const Calibration& c) {
               Finding finding =
                   likely(LikelyCause::kCertifiedLength, about_length(wrong.from, wrong.to),
                          {in_mm("stated", wrong.length_m)});
               const auto its = std::ranges::find_if(
                   c.lengths, [&](const LengthResult& l) { return is_of(l, wrong); });
               if (its != c.lengths.end())
                 finding.evidence.push_back(in_mm("measured", its->by_others_m, its->sigma_m));
               return finding;
             }});
}

}  // namespace

namespace mistakes {

void diameters(const Asked& asked) {
  constexpr double kAnyRadiusM = 0.01;
  asked.with_cell([](Cell& cell) { cell.radius_offset_sigma_m = kAnyRadiusM; },
                  [](const Calibration& c) {
                    const double rho_m =
                        correction_of(c, tool_parameter(ParameterKind::kEffectiveRadius, 0));
                    return likely(LikelyCause::kAllDiameters, {}, {in_mm("off", 2.0 * rho_m)});
                  });
  for (std::size_t t = 0; t < asked.cell.targets.size(); ++t) {
    const Target& target = asked.cell.targets[t];
    if (target.kind != TargetKind::kSphere) continue;
    asked.with_cell([&](Cell& cell) { cell.targets[t].diameter_sigma_m = 2.0 * kAnyRadiusM; },
                    [&](const Calibration& c) {
                      const double radius_m =
                          correction_of(c, target_parameter(ParameterKind::kRadius, t));
                      return likely(LikelyCause::kDiameter, about_target(target),
                                    {in_mm("off", 2.0 * radius_m)});
                    });
  }
}

/// One that is wrong, or two that are each other's.
void certified_lengths(const Asked& asked) {
  const auto& lengths = asked.cell.lengths;
  for (std::size_t k = 0; k < std::min(kMostPairs, lengths.size()); ++k) {
    const auto here = lengths.begin() + static_cast<std::ptrdiff_t>(k);
    if (std::none_of(lengths.begin(), here,
                     [&](const CertifiedLength& l) { return same_ends(l, *here); }))
      without_length(asked, *here);
  }
  for_each_pair(lengths.size(), [&](std::size_t a, std::size_t b) {
    asked.with_cell(
        [=](Cell& cell) { std::swap(cell.lengths[a].length_m, cell.lengths[b].length_m); },
        always(likely(LikelyCause::kExchangedLengths, {}, {},
                      {{about_length(lengths[a].from, lengths[a].to), {}},
                       {about_length(lengths[b].from, lengths[b].to), {}}})));
  });
}

void contradicted_length(const Asked& asked) {
  const auto wrong = std::ranges::find_if(
      asked.cell.lengths, [&](const CertifiedLength& l) { return is_of(*asked.contradicted, l); });
  if (wrong != asked.cell.lengths.end()) without_length(asked, *wrong);
}

void lengths_of_an_end(const Asked& asked) {
  const auto& lengths = asked.cell.lengths;
  for (const std::string& end : {asked.contradicted->from, asked.contradicted->to}) {
    const auto of_end = [&](const CertifiedLength& l) { return l.from == end || l.to == end; };
    const auto own = std::ranges::count_if(lengths, of_end);
    // With none left anything would make sense.
    if (own < 2 || own == static_cast<std::ptrdiff_t>(lengths.size())) continue;
    const Target& target = asked.cell.targets[asked.cell.target_index(end)];
    asked.ask({silenced(asked.cell, of_end), asked.touches,
               always(likely(LikelyCause::kLengthsOfTarget, about_target(target),
                             {{"lengths", static_cast<double>(own), ""}}))});
  }
}

void all_lengths(const Asked& asked) {
  asked.ask({silenced(asked.cell), asked.touches, always(likely(LikelyCause::kAllLengths))});
}

/// Where to begin, no more: of each target whose centre is held, and of all these.
void stated_centres(const Asked& asked) {
  Hypothesis none{asked.cell, asked.touches, always(likely(LikelyCause::kAllCentres))};
  std::size_t held = 0;
  for (std::size_t t = 0; t < asked.cell.targets.size(); ++t) {
    const Target& target = asked.cell.targets[t];
    if (!centre_is_held(target)) continue;
    const auto unheld = [t](Cell& c) { c.targets[t].centre_sigma_m = 0.0; };
    unheld(none.cell);
    if (++held > kMostTargets) continue;
    asked.with_cell(unheld, [&](const Calibration& c) {
      Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
      for (const TargetResult& one : c.targets)
        if (one.id == target.id) centre_m = one.centre_m;
      return likely(LikelyCause::kStatedCentre, about_target(target),
                    {in_mm("off", (centre_m - target.centre_m).norm())});
    });
  }
  none.changes = held;
  if (held > 1) asked.ask(none);
}

}  // namespace mistakes

}  // namespace cellcal::calib
