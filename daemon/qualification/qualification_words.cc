#include <fmt/format.h>

#include <algorithm>

#include "calib/model/units.h"
#include "daemon/qualification/qualification.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;
using calib::kMsPerS;

double longest_m(const Qualification& q) {
  double longest_m = 0.0;
  for (const Overtravel& o : q.overtravel) longest_m = std::max(longest_m, o.median_m);
  return longest_m;
}

std::string words(QualificationFinding finding, const Qualification& q) {
  switch (finding) {
    case QualificationFinding::kNoiseAboveStated:
      return fmt::format(
          "{:.3f} +- {:.3f} mm touch noise, {:.3f} mm stated. Clean tip and spheres; tighten tip, spheres "
          "and tool; qualify again. If it stays, set sigma_mm = {:.3f} under [touch] in the cell file",
          kMmPerM * q.noise_m->value, kMmPerM * q.noise_m->sigma, kMmPerM * q.stated.touch_sigma_m,
          kMmPerM * q.noise_m->value);
    case QualificationFinding::kOvertravelTooLong:
      return fmt::format(
          "{:.2f} mm overtravel at the median (limit {:.1f} mm). Set a smaller fast_search_mm_s under "
          "[motion]",
          kMmPerM * longest_m(q), kMmPerM * kOvertravelLimitM);
    case QualificationFinding::kDelayNotAsStated:
      return fmt::format(
          "{:.2f} +- {:.2f} ms latch delay, {:.2f} +- {:.2f} ms stated. Set delay_ms = {:.2f} and "
          "delay_sigma_ms = {:.2f} under [touch] in the cell file",
          kMsPerS * q.delay->delay_s, kMsPerS * q.delay->sigma_s, kMsPerS * q.stated.delay_s,
          kMsPerS * q.stated.delay_sigma_s, kMsPerS * q.delay->delay_s,
          kMsPerS * std::max(q.delay->sigma_s, 1e-5));
    case QualificationFinding::kRadiusNotAsStated:
      return fmt::format(
          "{:+.2f} +- {:.2f} mm effective radius minus stated radius of {} and tip. Check diameter_mm and "
          "tip_radius_mm in the cell file",
          kMmPerM * q.radius_offset_m->value, kMmPerM * q.radius_offset_m->sigma, q.target);
  }
  return {};
}

}  // namespace

std::vector<std::string> in_words(const Qualification& q) {
  std::vector<std::string> lines{
      fmt::format("{} touches on {} at {} places", q.touches, q.target, q.places)};
  if (q.noise_m)
    lines.push_back(fmt::format("touch noise       {:.3f} +- {:.3f} mm, 1 sigma ({:.3f} mm stated)",
                                kMmPerM * q.noise_m->value, kMmPerM * q.noise_m->sigma,
                                kMmPerM * q.stated.touch_sigma_m));
  else
    lines.emplace_back("touch noise       not measured: too few touches");
  for (const Overtravel& o : q.overtravel)
    lines.push_back(
        fmt::format("overtravel        {:.3f} mm median, {:.3f} mm worst of {} at {:.1f} mm/s",
                    kMmPerM * o.median_m, kMmPerM * o.worst_m, o.searches, kMmPerM * o.speed_m_s));
  if (q.delay)
    lines.push_back(
        fmt::format("latch delay       {:.2f} +- {:.2f} ms ({:.2f} +- {:.2f} ms stated)",
                    kMsPerS * q.delay->delay_s, kMsPerS * q.delay->sigma_s,
                    kMsPerS * q.stated.delay_s, kMsPerS * q.stated.delay_sigma_s));
  else
    lines.emplace_back("latch delay       not measured: too few touches, or one speed only");
  if (q.radius_offset_m)
    lines.push_back(fmt::format("effective radius  {:+.3f} +- {:.3f} mm from the stated one",
                                kMmPerM * q.radius_offset_m->value,
                                kMmPerM * q.radius_offset_m->sigma));
  else
    lines.emplace_back("effective radius  not resolved by one sphere; a calibration does");
  lines.push_back(fmt::format("contact to stop   {:.1f} ms worst; {} bounces at most",
                              kMsPerS * q.reaction_worst_s, q.bounces_worst));
  for (const QualificationFinding finding : q.findings)
    lines.push_back("not as stated: " + words(finding, q));
  lines.emplace_back(q.passed() ? "result: qualified" : "result: not qualified");
  return lines;
}

}  // namespace cellcal::daemon
