#include "daemon/cli/frames_sent.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "daemon/cli/ask.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/frames.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/cli/user_name.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

json values_of(const calib::FrameMmDeg& f) {
  return {{"xyz_mm", f.xyz_mm}, {"abc_deg", f.abc_deg}};
}

std::string frame_line(const json& values) {
  std::string text = "{";
  const json &xyz = values.at("xyz_mm"), &abc = values.at("abc_deg");
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format("{} {:.4f},", "XYZ"[i], xyz.at(i).get<double>());
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format("{} {:.5f}{}", "ABC"[i], abc.at(i).get<double>(), i < 2 ? "," : "}");
  return text;
}

/// The controller's frame and that of $config.dat are not the same: which of them is it?
bool apart(const json& values, const calib::FrameMmDeg& stated) {
  constexpr double kMm = 1e-3, kDeg = 1e-4;  // more than files and pendants round to
  for (std::size_t i = 0; i < 3; ++i)
    if (std::abs(values.at("xyz_mm").at(i).get<double>() - stated.xyz_mm[i]) > kMm ||
        std::abs(values.at("abc_deg").at(i).get<double>() - stated.abc_deg[i]) > kDeg)
      return true;
  return false;
}

void require_yes(bool confirmed, const std::string& question) {
  if (confirmed) return;
  if (::isatty(STDIN_FILENO) != 1)
    throw std::runtime_error(
        "nobody is there to ask. Give --confirm when old and new values were looked at");
  std::cerr << question << " Type yes to set it: " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "yes") throw std::runtime_error("not confirmed: nothing was set");
}

}  // namespace

int send_frames(const Connection& daemon, const FramesCommand& frames, const SendFrames& how) {
  const calib::Calibration calibration = calib::load_calibration(frames.calibration);
  // Also with --withheld, which is to look at it.
  if (!calibration.verdict.publish) {
    fmt::print(stderr, "the calibration was withheld: its frames are not set on a controller\n");
    return kNotPublishable;
  }
  const krl::ProposedFrames proposed = frames_of(frames, calibration);
  if (proposed.frames.empty())
    throw std::runtime_error("nothing to set: name a frame with --tool or --base");
  json all = json::array();
  for (const krl::ProposedFrame& one : proposed.frames) {
    const json was =
        parse(ask(daemon, "POST", "/v1/frames/read", json{{"frame", one.name}}.dump()));
    if (one.old && apart(was, *one.old))
      throw std::runtime_error(fmt::format(
          "{} on the controller is {}, in the files given with --config {}. Give the controller's own "
          "$config.dat, or none",
          one.name, frame_line(was), frame_line(values_of(*one.old))));
    fmt::print(stderr, "{} now  {}\n{} then {}\n", one.name, frame_line(was), one.name,
               frame_line(values_of(one.frame)));
    require_yes(how.confirm, "Every point taught in " + one.name + " moves with it.");
    const json body{{"frame", one.name},
                    {"values", values_of(one.frame)},
                    {"was", {{"xyz_mm", was.at("xyz_mm")}, {"abc_deg", was.at("abc_deg")}}},
                    {"reason", printable("calibration " + frames.calibration.filename().string())},
                    {"by", user_name()},
                    {"confirm", true}};
    const json done = parse(ask(daemon, "POST", "/v1/frames", body.dump()));
    all.push_back(done);
    if (!daemon.json) put(printable(done.value("words", "")) + "\n", {});
  }
  if (daemon.json) put(all.dump() + "\n", {});
  return kSuccess;
}

int list_sent_frames(const Connection& daemon) {
  const json all = parse(ask(daemon, "GET", "/v1/frames"));
  if (daemon.json) {
    put(all.dump() + "\n", {});
    return kSuccess;
  }
  std::string words;
  for (const json& one : all.at("frames"))
    words += printable(fmt::format("{:>4}  {:<20}  {:<8}  by {} ({}): {}", one.at("id").get<int>(),
                                   one.value("time", "").substr(0, 19), one.value("outcome", ""),
                                   one.value("by", ""), one.value("reason", ""),
                                   one.value("words", ""))) +
             "\n";
  if (all.at("problem").is_string()) words += printable(all["problem"].get<std::string>()) + "\n";
  put(words.empty() ? "no frame was sent to the controller\n" : words, {});
  return kSuccess;
}

int restore_frame(const Connection& daemon, const SendFrames& how) {
  const json all = parse(ask(daemon, "GET", "/v1/frames"));
  for (const json& one : all.at("frames"))
    if (one.at("id") == how.restore)
      fmt::print(stderr, "{} as it was before number {}: {}\n", one.value("frame", ""), how.restore,
                 frame_line(one.at("before")));
  require_yes(how.confirm, "Every point taught in it moves with it.");
  const json body{{"id", how.restore}, {"by", user_name()}, {"confirm", true}};
  const json done = parse(ask(daemon, "POST", "/v1/frames/restore", body.dump()));
  put(daemon.json ? done.dump() + "\n" : printable(done.value("words", "")) + "\n", {});
  return kSuccess;
}

}  // namespace cellcal::daemon
