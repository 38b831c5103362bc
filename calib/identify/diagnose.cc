#include "calib/identify/diagnose.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <optional>

#include "calib/files/error.h"
#include "calib/identify/attempt.h"
#include "calib/identify/causes.h"
#include "calib/identify/discrepancy.h"
#include "calib/identify/identify.h"
#include "calib/identify/jump.h"
#include "calib/identify/labels.h"
#include "calib/identify/lengths.h"
#include "calib/identify/moved.h"
#include "calib/identify/outliers.h"
#include "calib/identify/sizes.h"
#include "calib/identify/target_place.h"
#include "calib/identify/verdict.h"

namespace cellcal::calib {

namespace {

bool moved_alone(const std::vector<Cause>& causes) {
  return std::all_of(causes.begin(), causes.end(),
                     [](const Cause& c) { return c.moved.has_value(); });
}

/// The calibration, if all makes sense.
std::optional<Calibration> sensible(const Cell& cell, const std::vector<Touch>& touches,
                                    const IdentifyOptions& options) {
  try {
    Calibration calibration = identify_as_stated(cell, touches, options);
    confirm_moves(cell, touches, options, calibration);
    if (calibration.moved.empty() && calibration.verdict.publish) return calibration;
  } catch (const IdentifyError&) {
  }
  return std::nullopt;
}

/// The calibration without these lengths, if all makes sense then.
std::optional<Calibration> sensible_without(
    const Cell& cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
    const std::function<bool(const CertifiedLength&)>& which) {
  return sensible(silenced(cell, which), touches, options);
}

/// The stated centre that is wrong, if all makes sense where it is no more than where to begin.
std::string held_centre(const Cell& cell, const std::vector<Touch>& touches,
                        const IdentifyOptions& options) {
  constexpr std::size_t kMostTargets = 12;
  Cell none = cell;
  std::size_t held = 0;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!centre_is_held(target)) continue;
    none.targets[t].centre_sigma_m = 0.0;
    if (++held > kMostTargets) continue;
    Cell changed = cell;
    changed.targets[t].centre_sigma_m = 0.0;
    if (sensible(changed, touches, options))
      return fmt::format(
          "with {} not held where the cell file states it everything makes sense; check its "
          "centre_mm, or state a larger centre_sigma_mm",
          target.id);
  }
  if (held > 1 && sensible(none, touches, options))
    return "with no centre held where the cell file states it everything makes sense; check "
           "centre_mm, or state a larger centre_sigma_mm";
  return {};
}

/// The certified length that all else contradicts most, where all makes sense without it; or empty.
std::string wrong_length(const Cell& cell, const std::vector<Touch>& touches,
                         const IdentifyOptions& options, const Calibration& calibration) {
  const LengthResult* worst = worst_contradicted(calibration.lengths);
  if (worst == nullptr) return {};
  for (const CertifiedLength& wrong : cell.lengths) {
    if (!is_of(*worst, wrong)) continue;
    const auto which = [&](const CertifiedLength& l) { return same_ends(l, wrong); };
    if (const auto without = sensible_without(cell, touches, options, which))
      return without_length(wrong, *without);
    break;
  }
  return {};
}

/// Where certified lengths are contradicted, and no one alone is to blame: which targets stand
/// elsewhere than when they were measured. Empty where that does not mend it either.
std::string wrong_places(const Cell& cell, const std::vector<Touch>& touches,
                         const IdentifyOptions& options, const Calibration& calibration) {
  const LengthResult* worst = worst_contradicted(calibration.lengths);
  if (worst == nullptr) return {};
  if (const auto names = better_names(cell, touches))
    if (sensible(cell, names->given_to(cell, touches), options))
      return names->words(cell) + " all makes sense; check which is which";
  if (const std::string words = held_centre(cell, touches, options); !words.empty()) return words;
  for (const std::string& end : {worst->from, worst->to}) {
    const auto of_end = [&](const CertifiedLength& l) { return l.from == end || l.to == end; };
    const auto own = std::count_if(cell.lengths.begin(), cell.lengths.end(), of_end);
    // With none left anything would make sense.
    if (own < 2 || own == static_cast<std::ptrdiff_t>(cell.lengths.size())) continue;
    if (sensible_without(cell, touches, options, of_end))
      return fmt::format(
          "without the {} certified lengths of {} everything makes sense; does it stand where it "
          "stood when they were measured?",
          own, end);
  }
  if (sensible_without(cell, touches, options, [](const CertifiedLength&) { return true; }))
    return "without any certified length everything makes sense; more than one of them is wrong, "
           "or several targets stand elsewhere than when they were measured";
  return {};
}

/// What a size has to be for everything to make sense, if there is one.
std::optional<SizeResult> mended_size(const Cell& cell, const std::vector<Touch>& touches,
                                      const IdentifyOptions& options, SizeResult size) {
  constexpr int kSteps = 4;  // the first one is with the outliers that the wrong size made
  try {
    for (int step = 0; step < kSteps; ++step) {
      const PutRight right = put_right(cell, touches, size);
      if (is_of_sphere(cell, size) &&
          right.cell.targets[cell.target_index(size.target)].diameter_m < 0.0)
        return std::nullopt;
      const Calibration found = identify_as_stated(right.cell, right.touches, options);
      const auto own =
          std::find_if(found.sizes.begin(), found.sizes.end(),
                       [&](const SizeResult& other) { return other.target == size.target; });
      if (own == found.sizes.end()) return std::nullopt;
      size.off_m += own->off_m;
      size.sigma_m = own->sigma_m;
      if (contradiction(*own) < 1.0) break;
    }
  } catch (const IdentifyError&) {
    return std::nullopt;
  }
  const PutRight right = put_right(cell, touches, size);
  return sensible(right.cell, right.touches, options) ? std::optional(size) : std::nullopt;
}

/// Of all fit touches of a wire, those that were left out, too.
double median_residual_m(const Calibration& c, const std::vector<Touch>& touches,
                         const std::string& target) {
  std::vector<double> all;
  for (const TouchResidual& r : c.residuals)
    if (touches[r.touch].target == target && touches[r.touch].set == TouchSet::kFit)
      all.push_back(r.after_m);
  if (all.empty()) return 0.0;
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                   all.end());
  return all[all.size() / 2];
}

/// Sizes that all else contradicts, most first; and before them, of targets whose touches were left
/// out for the most part and so say nothing, those that let them in again.
std::vector<SizeResult> suspected_sizes(const Cell& cell, const std::vector<Touch>& touches,
                                        const IdentifyOptions& options,
                                        const Calibration& calibration) {
  constexpr double kAboutAsMuch = 0.7, kAnyDiameterM = 0.02;
  constexpr std::size_t kMost = 3;
  std::vector<SizeResult> suspects;
  for (const Target& target : cell.targets) {
    if (suspects.size() == kMost) break;
    const FitTouches own = fit_touches_of(target.id, touches, calibration);
    if (2 * own.left_out <= own.all) continue;
    if (target.kind == TargetKind::kWire)
      suspects.push_back({target.id, median_residual_m(calibration, touches, target.id), 0.0});
    if (target.kind != TargetKind::kSphere) continue;
    Cell loose = cell;
    loose.targets[cell.target_index(target.id)].diameter_sigma_m = kAnyDiameterM;
    try {
      for (const ParameterResult& p : identify_as_stated(loose, touches, options).parameters)
        if (p.name == target.id + ".radius") suspects.push_back({target.id, p.correction, p.sigma});
    } catch (const IdentifyError&) {
    }
  }
  if (const SizeResult* worst = worst_contradicted(calibration.sizes)) {
    std::vector<SizeResult> contradicted = calibration.sizes;
    std::erase_if(contradicted, [&](const SizeResult& size) {
      return contradiction(size) < kAboutAsMuch * contradiction(*worst) ||
             std::any_of(suspects.begin(), suspects.end(),
                         [&](const SizeResult& one) { return one.target == size.target; });
    });
    std::stable_sort(contradicted.begin(), contradicted.end(),
                     [](const SizeResult& x, const SizeResult& y) {
                       return contradiction(x) > contradiction(y);
                     });
    contradicted.resize(std::min(kMost, contradicted.size()));
    suspects.insert(suspects.end(), contradicted.begin(), contradicted.end());
  }
  return suspects;
}

/// Where a diameter or a wire's zero is contradicted: which one it is; several where the touches
/// do not tell. Empty where none alone mends it.
std::string wrong_size(const Cell& cell, const std::vector<Touch>& touches,
                       const IdentifyOptions& options, const Calibration& calibration) {
  constexpr double kLikely = 10.0;  // squared sigmas behind the likeliest: e^-5
  struct Mended {
    std::string words;
    double misfit;
  };
  std::vector<Mended> all;
  int spheres = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const SizeResult& size : suspected_sizes(cell, touches, options, calibration)) {
    const auto mended = mended_size(cell, touches, options, size);
    if (!mended) continue;
    const PutRight right = put_right(cell, touches, *mended);
    all.push_back({size_words(cell, *mended), attempt(right.cell, right.touches).sum});
    if (is_of_sphere(cell, size)) ++spheres;
    least = std::min(least, all.back().misfit);
  }
  std::vector<std::string> words;
  for (const Mended& one : all)
    if (one.misfit < least + kLikely) words.push_back(one.words);
  if (words.empty()) return {};
  return fmt::format("with {} everything makes sense; check {}", fmt::join(words, ", or with "),
                     spheres == 0 ? "where the wire reads zero"
                     : cell.lengths.empty()
                         ? "diameter_mm, and that it is clean"
                         : "diameter_mm, that it is clean, and its certified lengths");
}

/// Where a certified length or a size is contradicted: what is wrong. The one of them that all else
/// contradicts most, or another; empty where nothing alone mends it.
std::string wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                          const IdentifyOptions& options, const Calibration& calibration) {
  const LengthResult* length = worst_contradicted(calibration.lengths);
  const SizeResult* size = worst_contradicted(calibration.sizes);
  std::array in_turn{wrong_length, wrong_size, wrong_places};
  if (length != nullptr && size != nullptr && contradiction(*size) > contradiction(*length))
    std::swap(in_turn[0], in_turn[1]);
  for (const auto& wrong : in_turn)
    if (std::string words = wrong(cell, touches, options, calibration); !words.empty())
      return words;
  return {};
}

/// Of a move that was confirmed while certified lengths held the targets: wrong ones pull targets
/// about, too, and a target that moved contradicts right ones. It moved if it does without them.
void tell_from_lengths(const Cell& cell, const std::vector<Touch>& touches,
                       const IdentifyOptions& options, Calibration& calibration) {
  if (calibration.lengths.empty()) return;
  auto& reasons = calibration.verdict.reasons;
  const Cell changed = silenced(cell, [](const CertifiedLength&) { return true; });
  try {
    Calibration without = identify_as_stated(changed, touches, options);
    without.moved = calibration.moved;
    for (MovedTarget& target : without.moved)
      target.many_left_out = true;  // other touches may be, here
    confirm_moves(changed, touches, options, without);
    if (!without.moved.empty()) {
      calibration.lengths.clear();  // from where it stood or from where it stands, nobody knows
      std::erase_if(reasons,
                    [](const std::string& r) { return r.starts_with("certified length:"); });
      return;
    }
  } catch (const IdentifyError&) {
    return;  // the touches alone determine nothing, and so do not speak against it
  }
  const std::string moved = "moved target: ";
  if (reasons.front().starts_with(moved))
    reasons.front() = "moved target, or wrong certified lengths (without them nothing moved): " +
                      reasons.front().substr(moved.size()) + ", or mend the lengths";
}

/// Whether so many touches were left out that something may have moved or jumped, though gross
/// errors may do it, too.
bool many_left_out(const Cell& cell, const std::vector<Touch>& touches, const Calibration& c) {
  FitTouches all;
  for (const Target& target : cell.targets) {
    const FitTouches own = fit_touches_of(target.id, touches, c);
    if (own.left_out > 1 && 5 * own.left_out >= own.all) return true;
    all.all += own.all;
    all.left_out += own.left_out;
  }
  return 10 * all.left_out > all.all;
}

/// Where one jump in the middle of the session explains all: says so. A target's is confirmed as
/// a move.
bool told_of_jump(const Cell& cell, const std::vector<Touch>& touches,
                  const IdentifyOptions& options, Calibration& calibration) {
  // A level that was asked for may lack what the arm does, and that looks like jumps.
  if (options.level) return false;
  if (calibration.verdict.publish && calibration.jumped.empty() && calibration.moved.empty() &&
      !many_left_out(cell, touches, calibration))
    return false;
  constexpr double kUnlikely = -5.0;  // log odds
  const std::vector<Jump> all = jumps_by_odds(cell, touches, options, calibration);
  std::erase_if(calibration.moved, [&](const MovedTarget& moved) {
    return std::any_of(all.begin(), all.end(), [&](const Jump& jump) {
      return jump.what == Jump::What::kTarget && jump.name == moved.target &&
             jump.log_odds < kUnlikely;
    });
  });
  const std::vector<Jump> jumps = believed(all);
  calibration.jumped.clear();
  if (jumps.empty()) return false;
  // Something else is wrong, too, and is told instead; but nothing is let through for that.
  if (!jumps.front().mends && !calibration.verdict.publish) return false;
  if (jumps.size() > 1 || jumps.front().what != Jump::What::kTarget) {
    calibration.moved.clear();
    calibration.jumped = jumps;
    tell_of_jumps(cell, touches, options, calibration);
    return true;
  }
  const std::vector<MovedTarget> suspects = calibration.moved;
  MovedTarget moved;
  moved.target = jumps.front().name;
  moved.after_touch = jumps.front().after_touch;
  moved.shift_m = jumps.front().shift_m;
  moved.many_left_out = true;  // those behind it, or before, are honest
  calibration.moved = {moved};
  confirm_moves(cell, touches, options, calibration);
  if (calibration.moved.empty()) {
    calibration.moved = suspects;
    return false;
  }
  tell_from_lengths(cell, touches, options, calibration);
  std::erase_if(calibration.verdict.reasons,
                [](const std::string& r) { return r.starts_with("outliers:"); });
  return true;
}

/// Before all else: what a user is to look at first.
void tell(const std::vector<std::string>& causes, Calibration& calibration) {
  auto& reasons = calibration.verdict.reasons;
  auto at = reasons.begin();
  for (const std::string& cause : causes) at = reasons.insert(at, "likely cause: " + cause) + 1;
}

/// Whether the touches show, or may show, an error of the arm that the model lacks.
bool shows_discrepancy(const Calibration& c) {
  constexpr double kTooMuch = 4.0, kTooMuchBesideRepeats = 2.0, kEnoughRepeats = 5.0;
  const bool measured = c.repeats.degrees_of_freedom >= kEnoughRepeats;
  return c.touch_noise_m > kNothingM &&
         (c.discrepancy.alike > kFieldSigmas ||
          c.chi2_per_dof > (measured ? kTooMuchBesideRepeats : kTooMuch));
}

/// Where nothing else explains what the touches leave: with the model's own error estimated.
/// What is withheld either way is told as it was.
Calibration with_discrepancy(const Cell& cell, const std::vector<Touch>& touches,
                             IdentifyOptions options, Calibration stated) {
  if (options.level || options.with_discrepancy || !shows_discrepancy(stated)) return stated;
  options.with_discrepancy = true;
  try {
    Calibration estimated = identify_as_stated(cell, touches, options);
    estimated.discrepancy.alike = stated.discrepancy.alike;
    if (estimated.verdict.publish || stated.verdict.publish) return estimated;
    for (const std::string& reason : estimated.verdict.reasons)
      if (!is_note(reason))
        stated.verdict.reasons.push_back("model error: with it estimated, too, there is " + reason);
  } catch (const IdentifyError&) {
  }
  return stated;
}

}  // namespace

std::vector<std::string> likely_causes(const Cell& cell, const std::vector<Touch>& touches) {
  std::vector<std::string> words;
  for (Cause& cause : causes_of(cell, touches)) words.push_back(std::move(cause.words));
  if (words.empty())
    if (std::string scattered = scattered_words(cell, touches); !scattered.empty())
      words.push_back(std::move(scattered));
  return words;
}

Calibration identify(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options) {
  require_sound(cell, touches);
  try {
    Calibration calibration = identify_as_stated(cell, touches, options);
    if (const std::string words = wrong_measure(cell, touches, options, calibration);
        !words.empty()) {
      calibration.moved.clear();  // a wrong length pulls spheres about
      tell({words}, calibration);
      return calibration;
    }
    // Of so few, whatever was tried would explain all.
    if (calibration.verdict.too_few) return calibration;
    if (told_of_jump(cell, touches, options, calibration)) return calibration;
    std::vector<Cause> causes;
    if (!calibration.verdict.publish) causes = causes_of(cell, touches);
    // Another mistake moves targets, too.
    const bool moved = moved_alone(causes);
    for (const Cause& cause : causes) {
      if (!moved || !has_a_centre(cell.targets[cell.target_index(cause.moved->target)].kind))
        continue;
      const bool suspected =
          std::any_of(calibration.moved.begin(), calibration.moved.end(),
                      [&](const MovedTarget& m) { return m.target == cause.moved->target; });
      if (!suspected) calibration.moved.push_back(*cause.moved);
    }
    if (moved)
      confirm_moves(cell, touches, options, calibration);
    else
      calibration.moved.clear();
    if (!calibration.moved.empty()) tell_from_lengths(cell, touches, options, calibration);
    // What looks like a move, and would have been let through without it, may be another mistake.
    if (!calibration.moved.empty() && causes.empty()) {
      causes = causes_of(cell, touches);
      if (!causes.empty() && causes.front().moved) causes.clear();
    }
    if (calibration.moved.empty() || !moved_alone(causes)) {
      std::vector<std::string> words;
      for (const Cause& cause : causes) words.push_back(cause.words);
      tell(words, calibration);
    }
    if (calibration.moved.empty() && causes.empty())
      calibration = with_discrepancy(cell, touches, options, std::move(calibration));
    if (!calibration.verdict.publish && calibration.moved.empty() && causes.empty())
      if (const std::string words = scattered_words(cell, touches); !words.empty())
        tell({words}, calibration);
    return calibration;
  } catch (const IdentifyError& error) {
    Calibration nominal = not_identified(cell, touches, options, error.what());
    tell(likely_causes(cell, touches), nominal);
    return nominal;
  }
}

}  // namespace cellcal::calib
