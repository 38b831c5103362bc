#include "daemon/cli/frames.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"

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

/// A controller takes the first routine of a file by the file's name.
std::string program_name(const std::filesystem::path& file) {
  static const std::regex name_of_krl("[A-Za-z_][A-Za-z0-9_]{0,23}");
  std::string name = file.stem().string();
  if (!std::regex_match(name, name_of_krl))
    throw calib::FileError(
        file.string(), ": \"" + calib::shown(name) +
                           "\" is not a name of a KRL program. Give letters, digits and _, at most "
                           "24, the first no digit: cellcal_frames.src");
  return name;
}

/// How well a tool's tip is known; empty for a base.
calib::Phrase tip_phrase(const krl::ProposedFrame& one) {
  if (one.kind != krl::ProposedFrame::Kind::kTool) return {};
  if (one.sigma_mm == std::array<double, 3>{}) return "say.frames.tip.stated";
  return {"say.frames.tip",
          {{"x", 2 * one.sigma_mm[0]}, {"y", 2 * one.sigma_mm[1]}, {"z", 2 * one.sigma_mm[2]}}};
}

std::string report(const krl::ProposedFrames& result) {
  std::string text = result.config_lines;
  for (const krl::ProposedFrame& one : result.frames) {
    text += said({!one.old                  ? "say.frames.no_old"
                  : krl::is_empty(*one.old) ? "say.frames.old_empty"
                                            : "say.frames.from_old",
                  {{"frame", one.name},
                   {"mm", one.shift_mm},
                   {"deg", one.turn_deg},
                   {"tip", tip_phrase(one)}}});
  }
  if (!result.robroot_stated && !result.frames.empty() &&
      result.frames.back().kind == krl::ProposedFrame::Kind::kBase)
    text += said("say.correct.robroot");
  return text + said("say.frames.zeros");
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
  for (const calib::ZeroOffset& one : result.mastering)
    all["mastering_proposal"].push_back({{"joint", one.joint},
                                         {"offset_deg", one.offset_rad * calib::kDegPerRad},
                                         {"sigma_deg", one.sigma_rad * calib::kDegPerRad},
                                         {"decided_by", to_string(one.decided_by)}});
  return json_text(all);
}

using nlohmann::json;

std::string frame_line(const json& values) {
  std::string text = "{";
  const json &xyz = values.at("xyz_mm"), &abc = values.at("abc_deg");
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format("{} {:.4f},", "XYZ"[i], xyz.at(i).get<double>());
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format("{} {:.5f}{}", "ABC"[i], abc.at(i).get<double>(), i < 2 ? "," : "}");
  return text;
}

std::string now_words(const std::string& frame, const json& values) {
  return say({"say.frames.now", {{"frame", frame}, {"values", frame_line(values)}}});
}

/// True if the controller's frame differs from that of $config.dat, which makes the reference ambiguous.
bool apart(const json& values, const calib::FrameMmDeg& stated) {
  constexpr double kMm = 1e-3, kDeg = 1e-4;  // above the rounding of files and pendants
  for (std::size_t i = 0; i < 3; ++i)
    if (std::abs(values.at("xyz_mm").at(i).get<double>() - stated.xyz_mm[i]) > kMm ||
        std::abs(values.at("abc_deg").at(i).get<double>() - stated.abc_deg[i]) > kDeg)
      return true;
  return false;
}

bool is_tool(const krl::ProposedFrame& one) { return one.kind == krl::ProposedFrame::Kind::kTool; }

double shift_mm(const json& from, const json& to) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i)
    sum += std::pow(to.at("xyz_mm").at(i).get<double>() - from.at("xyz_mm").at(i).get<double>(), 2);
  return std::sqrt(sum);
}

/// Requires measured values and known positions for every frame to be set.
void require_known(const krl::ProposedFrame& one, const krl::ProposedFrames& proposed) {
  if (is_tool(one) && one.sigma_mm == std::array<double, 3>{})
    throw std::runtime_error(
        one.name +
        ": tip not measured by the touches, only stated in the cell file. Give xyz_sigma_mm there "
        "and calibrate; nothing was set");
  if (!is_tool(one) && !proposed.robroot_stated)
    throw std::runtime_error(
        one.name +
        ": $ROBROOT not known, the base would be off by it. Give the controller's $machine.dat "
        "with --config; nothing was set");
}

double turn_deg(const json& from, const json& to) {
  const auto rotation = [](const json& values) -> Eigen::Matrix3d {
    return calib::to_isometry({{}, values.at("abc_deg").get<std::array<double, 3>>()}).linear();
  };
  return Eigen::AngleAxisd(rotation(from).transpose() * rotation(to)).angle() * calib::kDegPerRad;
}

/// Displacement from the controller's value, with its uncertainty.
std::string move_words(const krl::ProposedFrame& one, const json& was, const json& then) {
  using Values = std::array<double, 3>;
  if (krl::is_empty({was.at("xyz_mm").get<Values>(), was.at("abc_deg").get<Values>()}))
    return say({"say.frames.old_empty", {{"frame", one.name}, {"tip", tip_phrase(one)}}});
  const double mm = shift_mm(was, then);
  if (!is_tool(one))
    return say(
        {"say.frames.moves", {{"frame", one.name}, {"mm", mm}, {"deg", turn_deg(was, then)}}});
  return say({"say.frames.tool_moves",
              {{"frame", one.name},
               {"mm", mm},
               {"x", 2 * one.sigma_mm[0]},
               {"y", 2 * one.sigma_mm[1]},
               {"z", 2 * one.sigma_mm[2]}}});
}

/// Record of a frame that was sent without confirmation that it was set.
std::optional<json> record_in(const std::exception& failure) {
  const auto* refusal = dynamic_cast<const DaemonRefusal*>(&failure);
  if (refusal == nullptr) return std::nullopt;
  json record = calib::parse_json(refusal->response.body);
  if (!record.is_object() || !record.contains("id")) return std::nullopt;
  return record;
}

/// "1 of 2 frames set before that: TOOL_DATA[1] ('cellcal frames --restore 8' sets it back)"
void name_done(const json& all, std::size_t wanted) {
  fmt::print(stderr, "{}\n", say({"say.frames.set_before", {{"n", all.size()}, {"all", wanted}}}));
  for (const json& done : all)
    fmt::print(stderr, "{}\n",
               say({"say.frames.set_back",
                    {{"frame", printable(done.value("frame", ""))}, {"n", done.value("id", 0)}}}));
}

/// Tip and target positions belong to one cell: the file has to be the calibration in use on the daemon.
void require_in_use(const Connection& daemon, const std::filesystem::path& file) {
  const std::string given = printable(file.filename().string());
  const json list = parse(ask(daemon, "GET", "/v1/versions?limit=100"));
  const auto active =
      std::ranges::find_if(list, [](const json& one) { return one.value("active", false); });
  if (active == list.end())
    throw std::runtime_error(
        given +
        ": no calibration in use on this daemon to compare with. Check the cell; "
        "--other-calibration overrides");
  const auto session = active->at("session").get<std::int64_t>();
  const json in_use =
      parse(ask(daemon, "GET", fmt::format("/v1/sessions/{}/calibration.json", session)));
  if (in_use == calib::parse_json(calib::read_file(file))) return;
  throw std::runtime_error(fmt::format(
      "{}: not the calibration in use on this daemon (session {}). Give that one, or activate this "
      "one; --other-calibration overrides",
      given, session));
}

void require_yes(bool confirmed, const std::string& question) {
  if (confirmed) return;
  if (::isatty(STDIN_FILENO) != 1)
    throw std::runtime_error(
        "no terminal to confirm. Compare old and new values, then give --confirm");
  std::cerr << say({"say.frames.type_yes", {{"question", question}}}) << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "yes") throw std::runtime_error("not confirmed: nothing was set");
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
  if (!command.output.empty()) request.program = program_name(command.output);
  return propose_frames(calibration, request);
}

int frames(const FramesCommand& command) {
  const auto calibration = usable_calibration("frames", command.calibration, command.withheld);
  if (!calibration) return kNotPublishable;
  const krl::ProposedFrames result = frames_of(command, *calibration);
  if (!command.output.empty()) put_as(as_krl, result.snippet, command.output);
  put(command.json ? json_of(result) : report(result), {});
  return kSuccess;
}

int send_frames(const Connection& daemon, const FramesCommand& frames, const SendFrames& how) {
  const calib::Calibration calibration = read_calibration(frames.calibration);
  // Also with --withheld, which only permits inspection.
  if (!calibration.verdict.publish()) {
    fmt::print(stderr, "{}\n", say("say.frames.withheld"));
    return kNotPublishable;
  }
  refuse_far(calibration, frames.calibration);
  const krl::ProposedFrames proposed = frames_of(frames, calibration);
  if (proposed.frames.empty())
    throw std::runtime_error("nothing to set: name a frame with --tool or --base");
  if (!how.other_calibration) require_in_use(daemon, frames.calibration);
  // All frames are read, compared with the files and shown before the first is set.
  std::vector<json> orders;
  for (const krl::ProposedFrame& one : proposed.frames) {
    require_known(one, proposed);
    const json was =
        parse(ask(daemon, "POST", "/v1/frames/read", json{{"frame", one.name}}.dump()));
    if (one.old && apart(was, *one.old))
      throw std::runtime_error(fmt::format(
          "{} on the controller is {}, in the files given with --config {}. Give the controller's own "
          "$config.dat, or none",
          one.name, frame_line(was), frame_line(frame_json(*one.old))));
    json then = frame_json(one.frame);
    // Touches determine the position of the tip but not the orientation of the tool.
    if (is_tool(one)) then["abc_deg"] = was.at("abc_deg");
    fmt::print(stderr, "{}\n{}\n{}\n", now_words(one.name, was),
               say({"say.frames.then", {{"frame", one.name}, {"values", frame_line(then)}}}),
               move_words(one, was, then));
    orders.push_back(
        {{"frame", one.name},
         {"values", then},
         {"was", {{"xyz_mm", was.at("xyz_mm")}, {"abc_deg", was.at("abc_deg")}}},
         {"reason", printable("calibration " + frames.calibration.filename().string())},
         {"by", user_name()},
         {"confirm", true}});
  }
  std::string names;
  for (const json& order : orders)
    names += (names.empty() ? "" : ", ") + order.at("frame").get<std::string>();
  require_yes(how.confirm, say({"say.frames.points_move", {{"frames", names}}}));
  json all = json::array();
  const auto print_done = [&] {
    if (daemon.json) put(all.dump() + "\n", {});
  };
  for (const json& order : orders) {
    try {
      all.push_back(parse(ask(daemon, "POST", "/v1/frames", order.dump())));
    } catch (const std::exception& failure) {
      name_done(all, orders.size());
      if (const auto record = record_in(failure)) all.push_back(*record);
      if (!all.empty()) print_done();
      throw;
    }
    if (!daemon.json) put(printable(all.back().value("words", "")) + "\n", {});
  }
  print_done();
  return kSuccess;
}

int list_sent_frames(const Connection& daemon) {
  const json all = parse(ask(daemon, "GET", "/v1/frames"));
  std::string words;
  for (const json& one : all.at("frames"))
    words += printable(fmt::format("{:>4}  {:<20}  {:<8}  by {} ({}): {}", one.at("id").get<int>(),
                                   one.value("time", "").substr(0, 19), one.value("outcome", ""),
                                   one.value("by", ""), one.value("reason", ""),
                                   one.value("words", ""))) +
             "\n";
  if (all.at("problem").is_string()) words += printable(all["problem"].get<std::string>()) + "\n";
  return print_result(daemon.json, all, words.empty() ? said("say.frames.none_sent") : words);
}

int restore_frame(const Connection& daemon, const SendFrames& how) {
  const json all = parse(ask(daemon, "GET", "/v1/frames"));
  if (all.at("problem").is_string())
    throw std::runtime_error(printable(all["problem"].get<std::string>()));
  const json& frames = all.at("frames");
  const auto found =
      std::ranges::find_if(frames, [&](const json& one) { return one.at("id") == how.restore; });
  if (found == frames.end())
    throw std::runtime_error(
        fmt::format("no frame was sent under number {}. See 'cellcal frames --sent'", how.restore));
  const std::string name = printable(found->value("frame", ""));
  const json was = parse(ask(daemon, "POST", "/v1/frames/read", json{{"frame", name}}.dump()));
  const json& then = found->at("before");
  fmt::print(stderr, "{}\n{}\n{}\n", now_words(name, was),
             say({"say.frames.then.as_before",
                  {{"frame", name}, {"values", frame_line(then)}, {"n", how.restore}}}),
             say({"say.frames.moves",
                  {{"frame", name}, {"mm", shift_mm(was, then)}, {"deg", turn_deg(was, then)}}}));
  require_yes(how.confirm, say({"say.frames.points_move", {{"frames", name}}}));
  const json body{{"id", how.restore}, {"by", user_name()}, {"confirm", true}};
  json done;
  try {
    done = parse(ask(daemon, "POST", "/v1/frames/restore", body.dump()));
  } catch (const std::exception& failure) {
    if (const auto record = record_in(failure); record && daemon.json)
      put(record->dump() + "\n", {});
    throw;
  }
  return print_result(daemon.json, done, printable(done.value("words", "")) + "\n");
}

int show_position(const Connection& daemon) {
  using nlohmann::json;
  const json answer = parse(ask(daemon, "POST", "/v1/position"));
  std::string text;
  for (const json& one : answer.at("axes_deg")) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{:.4f}", one.get<double>());
  }
  return print_result(daemon.json, answer, text + "\n");
}

}  // namespace cellcal::daemon
