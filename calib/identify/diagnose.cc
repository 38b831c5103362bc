#include "calib/identify/diagnose.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "calib/files/error.h"
#include "calib/identify/causes.h"
#include "calib/identify/identify.h"
#include "calib/identify/jump.h"
#include "calib/identify/labels.h"
#include "calib/identify/lengths.h"
#include "calib/identify/moved.h"
#include "calib/identify/target_place.h"

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

/// Where a certified length is contradicted: which one it is, or which target stands elsewhere than
/// when its lengths were measured. Empty where that alone does not mend it.
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

/// Where one jump in the middle of the session explains all: says so. A target's is confirmed as
/// a move.
bool told_of_jump(const Cell& cell, const std::vector<Touch>& touches,
                  const IdentifyOptions& options, Calibration& calibration) {
  // A level that was asked for may lack what the arm does, and that looks like jumps.
  if (options.level) return false;
  if (calibration.verdict.publish && calibration.jumped.empty() && calibration.moved.empty())
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
  try {
    Calibration calibration = identify_as_stated(cell, touches, options);
    if (const std::string words = wrong_length(cell, touches, options, calibration);
        !words.empty()) {
      calibration.moved.clear();  // a wrong length pulls spheres about
      calibration.verdict.reasons.push_back("likely cause: " + words);
      return calibration;
    }
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
    if (calibration.moved.empty() || !moved_alone(causes))
      for (const Cause& cause : causes)
        calibration.verdict.reasons.push_back("likely cause: " + cause.words);
    if (!calibration.verdict.publish && calibration.moved.empty() && causes.empty())
      if (const std::string words = scattered_words(cell, touches); !words.empty())
        calibration.verdict.reasons.push_back("likely cause: " + words);
    return calibration;
  } catch (const IdentifyError& error) {
    const auto causes = likely_causes(cell, touches);
    if (causes.empty()) throw;
    throw IdentifyError(
        fmt::format("{}; likely cause: {}", error.what(), fmt::join(causes, "; or ")));
  }
}

}  // namespace cellcal::calib
