#include "daemon/result/qualification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "daemon/session/interruption.h"

namespace cellcal::daemon {

namespace {

/// Probability 1/150, one-sided.
constexpr double kSigmas = 2.5;
/// For the delay, whose sigma comes from the same few touches: probability 1/100, two-sided.
constexpr double kDelaySigmas = 3.5;

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

struct Visit {
  std::size_t place = 0;
  double speed_m_s = 0.0;
  TouchContacts contacts;
};

std::vector<Visit> visits_of(const calib::Plan& plan, std::span<const RecordReading> readings,
                             double fast_m_s) {
  std::vector<Visit> visits(plan.touches.size());
  std::size_t place = 0;
  for (std::size_t i = 0; i < visits.size(); ++i) {
    const calib::PlannedTouch& touch = plan.touches[i];
    if (i > 0 && plan.touches[i - 1].end != touch.end) ++place;
    visits[i] = {place, touch.search_m_s > 0.0 ? touch.search_m_s : fast_m_s, {}};
  }
  for (auto& [touch, contacts] : contacts_of(readings))
    if (touch < visits.size()) visits[touch].contacts = contacts;
  std::erase_if(visits, [](const Visit& visit) { return !visit.contacts.fast_m; });
  return visits;
}

/// Ratios with a common speed difference; those of half the difference scatter twice as much, which the
/// median tolerates.
std::optional<ContactDelay> delay_of(const std::vector<Visit>& visits, double slow_m_s) {
  std::vector<FastAndSlow> touches;
  constexpr double kUnit = 1.0;  // [m/s]: contact_delay() divides by it
  for (const Visit& visit : visits) {
    const double difference = visit.speed_m_s - slow_m_s;
    if (visit.contacts.slow_m.empty() || !(difference >= kLeastSpeedDifferenceMS)) continue;
    const double slow = visit.contacts.slow_mean_m();
    touches.push_back({slow + (*visit.contacts.fast_m - slow) * (kUnit / difference), slow});
  }
  return contact_delay(touches, kUnit, 0.0);
}

/// Deviation of one depth per touch from the mean of its place: of its fast contact, corrected for the delay,
/// or of its slow ones, whose speed is constant.
std::optional<Figure> noise_of(const std::vector<Visit>& visits, double delay_s, bool slow,
                               int& dof) {
  std::map<std::size_t, std::vector<double>> places;
  for (const Visit& visit : visits) {
    if (!slow)
      places[visit.place].push_back(*visit.contacts.fast_m - visit.speed_m_s * delay_s);
    else if (!visit.contacts.slow_m.empty())
      places[visit.place].push_back(visit.contacts.slow_mean_m());
  }
  double squares = 0.0;
  for (const auto& [place, depths_m] : places) {
    const double middle = mean(depths_m);
    for (const double depth : depths_m) squares += (depth - middle) * (depth - middle);
    dof += static_cast<int>(depths_m.size()) - 1;
  }
  if (dof < 1) return std::nullopt;
  const double noise_m = std::sqrt(squares / dof);
  return Figure{noise_m, noise_m / std::sqrt(2.0 * dof)};
}

std::vector<Overtravel> overtravel_of(const calib::Plan& plan,
                                      std::span<const RecordReading> readings, double fast_m_s,
                                      double slow_m_s) {
  std::map<double, std::vector<double>, std::greater<>> by_speed;
  for (const RecordReading& one : readings) {
    if (one.touch >= plan.touches.size() || one.reading.settled_rad.empty()) continue;
    const calib::PlannedTouch& touch = plan.touches[one.touch];
    const double fast = touch.search_m_s > 0.0 ? touch.search_m_s : fast_m_s;
    const double beyond_m = travel_m(touch, one.reading.settled_rad) - one.reading.along_m;
    if (std::isfinite(beyond_m)) by_speed[one.reading.slow ? slow_m_s : fast].push_back(beyond_m);
  }
  std::vector<Overtravel> all;
  for (const auto& [speed, beyond_m] : by_speed)
    all.push_back({speed, static_cast<int>(beyond_m.size()), calib::median_between(beyond_m),
                   *std::max_element(beyond_m.begin(), beyond_m.end())});
  return all;
}

std::vector<QualificationFinding> findings_of(const Qualification& q) {
  std::vector<QualificationFinding> findings;
  // With the stated noise this ratio would be exceeded with probability 1/150.
  const double by_chance = 1.0 + kSigmas / std::sqrt(2.0 * std::max(1, q.noise_dof));
  if (q.noise_m && q.noise_m->value > by_chance * q.stated.touch_sigma_m)
    findings.push_back(QualificationFinding::kNoiseAboveStated);
  if (std::any_of(q.overtravel.begin(), q.overtravel.end(),
                  [](const Overtravel& o) { return o.median_m > kOvertravelLimitM; }))
    findings.push_back(QualificationFinding::kOvertravelTooLong);
  if (q.delay && std::abs(q.delay->delay_s - q.stated.delay_s) >
                     kDelaySigmas * std::hypot(q.delay->sigma_s, q.stated.delay_sigma_s))
    findings.push_back(QualificationFinding::kDelayNotAsStated);
  if (q.radius_offset_m &&
      std::abs(q.radius_offset_m->value) >
          kSigmas * std::hypot(q.radius_offset_m->sigma, q.stated.radius_offset_sigma_m))
    findings.push_back(QualificationFinding::kRadiusNotAsStated);
  return findings;
}

using calib::kMmPerM;
using calib::kMsPerS;
using calib::Phrase;

double longest_m(const Qualification& q) {
  double longest_m = 0.0;
  for (const Overtravel& o : q.overtravel) longest_m = std::max(longest_m, o.median_m);
  return longest_m;
}

/// A value of a file, with a decimal point in every language.
std::string stated(double value, int decimals) { return fmt::format("{:.{}f}", value, decimals); }

Phrase phrase(QualificationFinding finding, const Qualification& q) {
  const std::string id = std::string("say.qualify.") + to_string(finding);
  switch (finding) {
    case QualificationFinding::kNoiseAboveStated:
      return {id,
              {{"noise", kMmPerM * q.noise_m->value},
               {"u", 2.0 * kMmPerM * q.noise_m->sigma},
               {"stated", kMmPerM * q.stated.touch_sigma_m},
               {"set", stated(kMmPerM * q.noise_m->value, 3)}}};
    case QualificationFinding::kOvertravelTooLong:
      return {id, {{"mm", kMmPerM * longest_m(q)}, {"limit", kMmPerM * kOvertravelLimitM}}};
    case QualificationFinding::kDelayNotAsStated:
      return {id,
              {{"delay", kMsPerS * q.delay->delay_s},
               {"u", 2.0 * kMsPerS * q.delay->sigma_s},
               {"stated", kMsPerS * q.stated.delay_s},
               {"stated_u", 2.0 * kMsPerS * q.stated.delay_sigma_s},
               {"set", stated(kMsPerS * q.delay->delay_s, 2)},
               {"set_sigma", stated(kMsPerS * std::max(q.delay->sigma_s, 1e-5), 2)}}};
    case QualificationFinding::kRadiusNotAsStated:
      return {id,
              {{"mm", kMmPerM * q.radius_offset_m->value},
               {"u", 2.0 * kMmPerM * q.radius_offset_m->sigma},
               {"target", q.target}}};
  }
  return {};
}

}  // namespace

Qualification qualify(const calib::Plan& plan, std::span<const RecordReading> readings,
                      double fast_m_s, double slow_m_s, const StatedContact& stated,
                      std::optional<Figure> radius_offset_m, bool touches_are_slow) {
  const std::vector<Visit> visits = visits_of(plan, readings, fast_m_s);
  Qualification q;
  if (!plan.touches.empty()) q.target = plan.touches.front().target;
  q.touches = static_cast<int>(visits.size());
  for (std::size_t i = 0; i < visits.size(); ++i)
    q.places += i == 0 || visits[i].place != visits[i - 1].place;
  q.delay = delay_of(visits, slow_m_s);
  q.noise_m =
      noise_of(visits, q.delay ? q.delay->delay_s : stated.delay_s, touches_are_slow, q.noise_dof);
  q.overtravel = overtravel_of(plan, readings, fast_m_s, slow_m_s);
  for (const RecordReading& one : readings) {
    q.reaction_worst_s = std::max(q.reaction_worst_s, one.reading.reaction_s);
    q.bounces_worst = std::max(q.bounces_worst, one.reading.bounces);
  }
  constexpr double kResolved = 0.5;  // fraction of the prior: above, the result reflects the prior
  if (radius_offset_m && radius_offset_m->sigma < kResolved * stated.radius_offset_sigma_m)
    q.radius_offset_m = radius_offset_m;
  q.stated = stated;
  q.findings = findings_of(q);
  return q;
}

std::vector<Phrase> phrases(const Qualification& q) {
  std::vector<Phrase> lines{
      {"say.qualify.touches", {{"n", q.touches}, {"target", q.target}, {"places", q.places}}}};
  lines.push_back(q.noise_m
                      ? Phrase("say.qualify.noise", {{"mm", kMmPerM * q.noise_m->value},
                                                     {"u", 2.0 * kMmPerM * q.noise_m->sigma},
                                                     {"stated", kMmPerM * q.stated.touch_sigma_m}})
                      : "say.qualify.noise.unknown");
  for (const Overtravel& o : q.overtravel)
    lines.push_back({"say.qualify.overtravel",
                     {{"median", kMmPerM * o.median_m},
                      {"worst", kMmPerM * o.worst_m},
                      {"n", o.searches},
                      {"speed", kMmPerM * o.speed_m_s}}});
  lines.push_back(
      q.delay ? Phrase("say.qualify.delay", {{"ms", kMsPerS * q.delay->delay_s},
                                             {"u", 2.0 * kMsPerS * q.delay->sigma_s},
                                             {"stated", kMsPerS * q.stated.delay_s},
                                             {"stated_u", 2.0 * kMsPerS * q.stated.delay_sigma_s}})
              : "say.qualify.delay.unknown");
  lines.push_back(q.radius_offset_m ? Phrase("say.qualify.radius",
                                             {{"mm", kMmPerM * q.radius_offset_m->value},
                                              {"u", 2.0 * kMmPerM * q.radius_offset_m->sigma}})
                                    : "say.qualify.radius.unknown");
  lines.push_back(
      {"say.qualify.stop", {{"ms", kMsPerS * q.reaction_worst_s}, {"n", q.bounces_worst}}});
  for (const QualificationFinding finding : q.findings)
    lines.push_back({"say.qualify.not_as_stated", {{"what", phrase(finding, q)}}});
  lines.emplace_back(q.passed() ? "say.qualify.passed" : "say.qualify.failed");
  return lines;
}

}  // namespace cellcal::daemon
