#include "daemon/cli/frames.h"

#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "daemon/cli/offline.h"
#include "daemon/krl/frames.h"

namespace cellcal::daemon {

namespace {

constexpr int kMostNumber = 128;  // of TOOL_DATA and BASE_DATA on any controller

struct Base {
  int number = 0;
  std::array<std::string, 3> targets;
};

std::optional<Base> base_of(const std::string& text) {
  Base base;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), base.number);
  auto at = static_cast<std::size_t>(end - text.data());
  if (error != std::errc() || at >= text.size() || text[at] != '=' || base.number < 1 ||
      base.number > kMostNumber)
    return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto comma = i < 2 ? text.find(',', at + 1) : text.size();
    if (comma == std::string::npos) return std::nullopt;
    base.targets[i] = text.substr(at + 1, comma - at - 1);
    if (base.targets[i].empty() || base.targets[i].find(',') != std::string::npos)
      return std::nullopt;
    at = comma;
  }
  return base;
}

std::string decided_words(const krl::MasteringOffset& one) {
  switch (one.decided_by) {
    case calib::DecidedBy::kData:
      return "";
    case calib::DecidedBy::kPrior:
      return "  not determined by the touches (prior)";
    case calib::DecidedBy::kFrame:
      return "  not identifiable: fixed by convention";
  }
  return "";
}

std::string report(const krl::ProposedFrames& result) {
  std::string text = result.config_lines;
  for (const krl::ProposedFrame& one : result.frames) {
    text += one.old ? fmt::format("{}: {:.3f} mm and {:.4f} deg from the old one", one.name,
                                  one.shift_mm, one.turn_deg)
                    : fmt::format("{}: no old one in the files given with --config", one.name);
    if (one.kind == krl::ProposedFrame::Kind::kTool)
      text += one.sigma_mm == std::array<double, 3>{}
                  ? "; as the cell file states it (no xyz_sigma_mm)"
                  : fmt::format("; +- {:.3f}, {:.3f}, {:.3f} mm (k=2)", 2 * one.sigma_mm[0],
                                2 * one.sigma_mm[1], 2 * one.sigma_mm[2]);
    text += "\n";
  }
  if (!result.robroot_stated && !result.frames.empty() &&
      result.frames.back().kind == krl::ProposedFrame::Kind::kBase)
    text += "$ROBROOT not in the given files: the robot is taken to be at the world's origin\n";
  text += "\nmastering, a proposal only; cellcal writes none of it:\n";
  for (const krl::MasteringOffset& one : result.mastering)
    text += fmt::format("  {:<4} {:+.4f} +- {:.4f} deg (k=2){}\n", one.joint, one.offset_deg,
                        2 * one.sigma_deg, decided_words(one));
  return text +
         "WARNING: another mastering moves every taught point and the SafeOperation zones. "
         "Find out first\nwhy an axis is off (hit, changed motor), and leave it to trained staff.\n";
}

nlohmann::json frame_json(const calib::FrameMmDeg& f) {
  return {{"xyz_mm", f.xyz_mm}, {"abc_deg", f.abc_deg}};
}

std::string json_of(const krl::ProposedFrames& result) {
  nlohmann::json all = {{"frames", nlohmann::json::array()},
                        {"mastering_proposal", nlohmann::json::array()},
                        {"robroot_stated", result.robroot_stated},
                        {"snippet", result.snippet}};
  for (const krl::ProposedFrame& one : result.frames) {
    all["frames"].push_back({{"name", one.name}, {"frame", frame_json(one.frame)}});
    if (one.old) {
      all["frames"].back()["old"] = frame_json(*one.old);
      all["frames"].back()["shift_mm"] = one.shift_mm;
      all["frames"].back()["turn_deg"] = one.turn_deg;
    }
    if (one.kind == krl::ProposedFrame::Kind::kTool)
      all["frames"].back()["sigma_mm"] = one.sigma_mm;
  }
  for (const krl::MasteringOffset& one : result.mastering)
    all["mastering_proposal"].push_back({{"joint", one.joint},
                                         {"offset_deg", one.offset_deg},
                                         {"sigma_deg", one.sigma_deg},
                                         {"decided_by", to_string(one.decided_by)}});
  return all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

bool is_base(const std::string& text) { return base_of(text).has_value(); }

krl::ProposedFrames frames_of(const FramesCommand& command, const calib::Calibration& calibration) {
  krl::FramesRequest request;
  if (command.tool > 0) request.tool = command.tool;
  for (const std::string& text : command.bases) {
    const auto base = base_of(text);
    if (base) request.bases[base->number] = base->targets;
  }
  for (const auto& path : command.controller)
    request.controller.push_back({path.string(), calib::read_file(path, krl::kMostBytes + 1)});
  request.calibration = command.calibration.filename().string();
  return propose_frames(calibration, request);
}

int frames(const FramesCommand& command) {
  const auto calibration = usable_calibration("frames", command.calibration, command.withheld);
  if (!calibration) return kNotPublishable;
  const krl::ProposedFrames result = frames_of(command, *calibration);
  if (!command.output.empty()) put(result.snippet, command.output);
  put(command.json ? json_of(result) : report(result), {});
  return kSuccess;
}

}  // namespace cellcal::daemon
