// Creation of cell files over the network. No session runs while one is written; causes no motion.

#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/export/machine_data.h"
#include "calib/files/robot_file.h"
#include "calib/model/error.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr const char* kWriting = "a cell file is being written";

template <class Act>
auto cell_act(Act act) {
  try {
    return act();
  } catch (const calib::FileError& wrong) {
    throw RequestError(wrong.what());
  } catch (const CellNotWritten& refused) {
    using Why = CellNotWritten::Why;
    switch (refused.why) {
      case Why::kThere:
      case Why::kChanged:
      case Why::kMore:
        throw BusyError(refused.what());
      case Why::kName:
      case Why::kUnusable:
      case Why::kStorage:
        throw RequestError(refused.what());
    }
    throw;
  }
}

json cell_request(const Request& request) {
  json body = json::parse(request.body, nullptr, false);
  if (!body.is_object()) throw BadRequest("the body must be a JSON object");
  return body;
}

std::string text_of(const json& body, const char* key) {
  const auto found = body.find(key);
  if (found == body.end()) return {};
  if (!found->is_string()) throw BadRequest(std::string("\"") + key + "\" must be a string");
  return found->get<std::string>();
}

void refuse_others(const json& body, std::initializer_list<const char*> known) {
  for (const auto& [key, value] : body.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw BadRequest("\"" + printable(key) + "\" is not known here");
}

/// Throws RequestError.
std::filesystem::path cell_file_in(const std::string& text) {
  const std::filesystem::path file(text);
  if (!file.is_absolute() || printable(text) != text)
    throw RequestError("give the cell file as an absolute path");
  return file;
}

json shown_json(const std::string& name, const std::filesystem::path& file,
                const CellFileStore::Shown& shown) {
  return {{"name", name},
          {"file", file.string()},
          {"sha256", shown.sha256},
          {"kept", shown.kept},
          {"form", shown.form ? to_json(*shown.form) : json(nullptr)}};
}

json robots_json(const std::vector<calib::NamedRobot>& kept) {
  std::vector<calib::NamedRobot> robots = calib::shipped_robots();
  std::sort(robots.begin(), robots.end(),
            [](const auto& a, const auto& b) { return a.file < b.file; });
  robots.insert(robots.end(), kept.begin(), kept.end());
  json list = json::array();
  for (const calib::NamedRobot& one : robots)
    list.push_back({{"name", one.file}, {"model", one.robot.name}});
  return list;
}

}  // namespace

const CellFileStore& Api::shelf() {
  if (shelf_ == nullptr) throw NotFound("this daemon writes no cell files. Use 'cellcal new-cell'");
  return *shelf_;
}

std::optional<Response> Api::show_cell_form(const Call& call) {
  json answer{{"folder", shelf().folder().string()},
              {"cells", shelf().names()},
              {"robots", robots_json(shelf().robots())},
              {"reads_position", position_ && position_()},
              {"shown", nullptr}};
  if (const auto other = call.request.query.find("file"); other != call.request.query.end()) {
    const std::filesystem::path file = cell_file_in(other->second);
    keep_among_cells(call.request, file);
    answer["shown"] = shown_json(file.stem().string(), file,
                                 cell_act([&] { return CellFileStore::look_at(file); }));
    return Response{.body = dump(answer)};
  }
  const auto name = call.request.query.find("name");
  if (name == call.request.query.end()) return Response{.body = dump(answer)};
  const auto shown = cell_act([&] { return shelf().look(name->second); });
  if (!shown) throw NotFound("no cell \"" + printable(name->second) + "\" was made here");
  answer["shown"] = shown_json(name->second, shelf().file(name->second), *shown);
  return Response{.body = dump(answer)};
}

std::optional<Response> Api::read_cell_lists(const Call& call) {
  const json body = cell_request(call.request);
  refuse_others(body, {"spheres", "certificate"});
  const std::string spheres = text_of(body, "spheres"), certificate = text_of(body, "certificate");
  return cell_act([&] {
    json answer{{"spheres", json::array()}, {"lengths", json::array()}};
    if (!spheres.empty()) answer["spheres"] = to_json(spheres_in(spheres, "spheres"));
    if (!certificate.empty())
      answer["lengths"] = to_json(certificate_in(certificate, "certificate"));
    return Response{.body = dump(answer)};
  });
}

std::optional<Response> Api::import_robot(const Call& call) {
  const json body = cell_request(call.request);
  refuse_others(body, {"machine_data", "robcor"});
  const std::string machine = text_of(body, "machine_data"), robcor = text_of(body, "robcor");
  if (machine.empty()) throw BadRequest("\"machine_data\" must be the text of $machine.dat");
  return cell_act([&] {
    calib::MachineData data;
    calib::read_machine_data(machine, "$machine.dat", data);
    if (!robcor.empty()) calib::read_machine_data(robcor, "$robcor.dat", data);
    const calib::Robot robot = calib::arm_of_controller(data);
    for (const calib::Joint& joint : robot.joints)
      if (!(joint.max_speed_rad_s > 0.0))
        throw calib::FileError(
            "$machine.dat",
            ": no speed of " + joint.name + ": $VEL_AXIS_MA and $RAT_MOT_AX of it are needed");
    std::filesystem::path file;
    service_.alone(kWriting, [&] { file = shelf().keep(robot); });
    spdlog::info("robot file {} was written", file.string());
    return Response{201, "application/json",
                    dump({{"name", file.string()}, {"model", robot.name}})};
  });
}

std::optional<Response> Api::write_cell(const Call& call) {
  const json body = cell_request(call.request);
  refuse_others(body, {"name", "form", "instead_of", "from", "write"});
  if (body.contains("write") && !body["write"].is_boolean())
    throw BadRequest("\"write\" must be true or false");
  const bool write = body.value("write", true);
  const std::string name = text_of(body, "name"), instead_of = text_of(body, "instead_of");
  const std::string origin = text_of(body, "from");
  const std::filesystem::path from =
      origin.empty() ? std::filesystem::path() : cell_file_in(origin);
  keep_among_cells(call.request, from);
  return cell_act([&] {
    const std::filesystem::path file = shelf().file(name);
    const std::optional<CellFileStore::Shown> before =
        from.empty() ? shelf().look(name) : CellFileStore::look_at(from);
    const CellForm form = form_from_json(body.value("form", json()), file,
                                         before && before->form ? &*before->form : nullptr);
    const std::vector<std::string> warnings = CellFileStore::look_through(form);
    if (write) {
      service_.alone(kWriting, [&] { shelf().write(name, form, instead_of, from); });
      spdlog::info("cell file {} was written", file.string());
    }
    return Response{write ? 201 : 200, "application/json",
                    dump({{"file", file.string()},
                          {"written", write},
                          {"warnings", warnings},
                          {"form", to_json(form)}})};
  });
}

}  // namespace cellcal::daemon
