// Creation of cell files over the network. No session runs while one is written; causes no motion.

#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/export/machine_data.h"
#include "calib/files/cell_file.h"
#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/robot_file.h"
#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/pool.h"
#include "calib/words/phrase_json.h"
#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/api/page_data.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr const char* kWriting = "a cell file is being written";
constexpr const char* kProposing = "places of the spheres are being computed";

template <class Act>
auto cell_act(Act act) {
  try {
    return act();
  } catch (const calib::KeyError& wrong) {
    throw FieldError(wrong.what(), form_key(wrong.path), wrong.reason);
  } catch (const calib::FileError& wrong) {
    throw RequestError(wrong.what());
  } catch (const calib::PlanError& none) {
    throw RequestError(none.what());
  } catch (const CellNotWritten& refused) {
    using Why = CellNotWritten::Why;
    switch (refused.why) {
      case Why::kThere:
      case Why::kChanged:
      case Why::kMore: throw BusyError(refused.what());
      case Why::kName: throw FieldError(refused.what(), "name", refused.what());
      case Why::kStorage: throw RequestError(refused.what());
      case Why::kUnusable:
        throw FieldError(refused.what(), refused.fault.key, refused.fault.reason);
    }
    throw;
  }
}

std::string text_of(const json& body, const char* key) {
  const auto found = body.find(key);
  if (found == body.end()) return {};
  if (!found->is_string()) throw BadRequest(std::string("\"") + key + "\" must be a string");
  return found->get<std::string>();
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
  constexpr std::size_t kMovedAxes = 6;
  std::erase_if(robots, [](const calib::NamedRobot& one) {
    return one.robot.joints.size() != kMovedAxes + one.robot.first_turning();
  });
  std::sort(robots.begin(), robots.end(),
            [](const auto& a, const auto& b) { return a.file < b.file; });
  robots.insert(robots.end(), kept.begin(), kept.end());
  json list = json::array();
  for (const calib::NamedRobot& one : robots)
    list.push_back({{"name", one.file}, {"model", one.robot.name}});
  return list;
}

constexpr double kFastestUnitMmS = 1e4;

struct ImportedRobot {
  calib::Robot robot;
  json linear_unit{};  ///< of the answer; null: none carries the arm
};

json unit_json(const calib::Joint& unit) {
  const auto& along = unit.guide->along;
  return {{"name", unit.name},
          {"along", {along.x(), along.y(), along.z()}},
          {"min_mm", unit.min_rad * calib::kMmPerM},
          {"max_mm", unit.max_rad * calib::kMmPerM},
          {"max_speed_mm_s",
           unit.max_speed_rad_s > 0.0 ? json(unit.max_speed_rad_s * calib::kMmPerM) : json()}};
}

/// The unit that carries the arm, if the machine data describe it; else the arm's foot, and the reason.
void put_on_its_unit(const calib::MachineData& data, double speed_mm_s, ImportedRobot& imported) {
  try {
    std::optional<calib::Joint> unit = calib::linear_unit_of(data.external, data.robroot);
    if (!unit) return;
    unit->max_speed_rad_s = speed_mm_s / calib::kMmPerM;
    imported.linear_unit = unit_json(*unit);
    imported.robot.joints.insert(imported.robot.joints.begin(), std::move(*unit));
  } catch (const calib::FileError& missing) {
    imported.linear_unit = {{"missing", missing.what()}};
  }
}

ImportedRobot robot_of_controller(const std::string& machine, const std::string& robcor,
                                  double speed_mm_s) {
  calib::MachineData data;
  calib::read_machine_data(machine, "$machine.dat", data);
  if (!robcor.empty()) calib::read_machine_data(robcor, "$robcor.dat", data);
  ImportedRobot imported{calib::arm_of_controller(data)};
  for (const calib::Joint& joint : imported.robot.joints)
    if (!(joint.max_speed_rad_s > 0.0))
      throw calib::FileError("$machine.dat", ": no speed of " + joint.name +
                                                 ": $VEL_AXIS_MA and $RAT_MOT_AX of it are needed");
  put_on_its_unit(data, speed_mm_s, imported);
  return imported;
}

ImportedRobot robot_of_file(const std::string& text) {
  ImportedRobot imported{calib::read_robot(calib::TomlTable::parse(text, "robot file"))};
  refuse_positioner(imported.robot, "a cell form", "Write the cell file by hand");
  if (imported.robot.first_turning() > 0)
    imported.linear_unit = unit_json(imported.robot.joints.front());
  return imported;
}

double unit_speed_mm_s(const json& body) {
  const auto given = body.find("unit_speed_mm_s");
  if (given == body.end()) return 0.0;
  const double speed = given->is_number() ? given->get<double>() : -1.0;
  if (!(speed > 0.0 && speed <= kFastestUnitMmS))
    throw BadRequest("\"unit_speed_mm_s\" must be a number above 0, 10000 at most");
  return speed;
}

const CellFileStore& shelf_of(const Api& api) {
  if (api.shelf == nullptr)
    throw NotFound("this daemon writes no cell files. Use 'cellcal new-cell'");
  return *api.shelf;
}

Answer show_cell_form(Api& api, const Call& call) {
  json answer{{"folder", shelf_of(api).folder().string()},
              {"cells", shelf_of(api).names()},
              {"robots", robots_json(shelf_of(api).robots())},
              {"reads_position", api.position && api.position()},
              {"shown", nullptr}};
  if (const auto other = call.request.query.find("file"); other != call.request.query.end()) {
    const std::filesystem::path file = cell_file_in(other->second);
    keep_among_cells(api, call.request, file);
    answer["shown"] =
        shown_json(file.stem().string(), file, cell_act([&] { return CellFileStore::read(file); }));
    return Response{.body = dump(answer)};
  }
  const auto name = call.request.query.find("name");
  if (name == call.request.query.end()) return Response{.body = dump(answer)};
  const auto shown = cell_act([&] { return shelf_of(api).find(name->second); });
  if (!shown) throw NotFound("no cell \"" + printable(name->second) + "\" was made here");
  answer["shown"] = shown_json(name->second, shelf_of(api).file(name->second), *shown);
  return Response{.body = dump(answer)};
}

Answer read_cell_lists(Api&, const Call& call) {
  const json body = object_in(call.request.body, {"spheres", "certificate"});
  const std::string spheres = text_of(body, "spheres"), certificate = text_of(body, "certificate");
  return cell_act([&] {
    json answer{{"spheres", json::array()}, {"lengths", json::array()}};
    if (!spheres.empty()) answer["spheres"] = to_json(spheres_in(spheres, "spheres"));
    if (!certificate.empty())
      answer["lengths"] = to_json(certificate_in(certificate, "certificate"));
    return Response{.body = dump(answer)};
  });
}

Answer import_robot(Api& api, const Call& call) {
  const json body =
      object_in(call.request.body, {"machine_data", "robcor", "robot_file", "unit_speed_mm_s"});
  const double speed_mm_s = unit_speed_mm_s(body);
  const std::string machine = text_of(body, "machine_data"), robcor = text_of(body, "robcor");
  const std::string robot_file = text_of(body, "robot_file");
  if (machine.empty() == robot_file.empty())
    throw BadRequest(
        "give either \"machine_data\", the text of $machine.dat, or \"robot_file\", that of a "
        "robot file");
  return cell_act([&] {
    const auto [robot, linear_unit] = machine.empty()
                                          ? robot_of_file(robot_file)
                                          : robot_of_controller(machine, robcor, speed_mm_s);
    std::filesystem::path file;
    api.service.alone(kWriting, [&, &arm = robot] { file = shelf_of(api).keep(arm); });
    spdlog::info("robot file {} was written", file.string());
    json answer{{"name", file.string()}, {"model", robot.name}};
    if (!linear_unit.is_null()) answer["linear_unit"] = linear_unit;
    return Response{201, "application/json", dump(answer)};
  });
}

Answer keep_mesh(Api& api, const Call& call) {
  return cell_act([&] {
    CellFileStore::KeptMesh kept;
    api.service.alone(kWriting, [&] { kept = shelf_of(api).keep_mesh(call.request.body, "STL"); });
    spdlog::info("STL file {} was written", kept.file.string());
    return Response{201, "application/json",
                    dump({{"file", kept.file.string()},
                          {"triangles", kept.triangles},
                          {"low_mm", kept.low_mm},
                          {"high_mm", kept.high_mm}})};
  });
}

Answer read_cell_file(Api&, const Call& call) {
  const json body = object_in(call.request.body, {"cell"});
  const std::string text = text_of(body, "cell");
  return cell_act([&] {
    const UploadedCell read = uploaded_cell(text, "cell file");
    return Response{
        .body =
            dump({{"form", to_json(read.form)}, {"kept", read.kept}, {"missing", read.missing}})};
  });
}

CellForm unfinished_form(Api& api, const Call& call) {
  const json body = object_in(call.request.body, {"form", "from"});
  const std::string origin = text_of(body, "from");
  const std::filesystem::path from =
      origin.empty() ? std::filesystem::path() : cell_file_in(origin);
  keep_among_cells(api, call.request, from);
  const auto before = from.empty() ? std::nullopt : CellFileStore::read(from).form;
  return form_from_json(body.value("form", json()), shelf_of(api).file("draft"),
                        before ? &*before : nullptr);
}

Answer draw_cell_form(Api& api, const Call& call) {
  return cell_act([&] {
    const calib::Cell cell = sketch_of(unfinished_form(api, call));
    const json joints = web::shown_joints(calib::middle_posture(cell.robot), cell.robot);
    return Response{.body = "{\"joints_deg\":" + dump(joints) +
                            ",\"scene\":" + web::scene_to_json(0, cell) + "}"};
  });
}

Answer suggest_places_of_form(Api& api, const Call& call) {
  return cell_act([&] {
    const CellForm form = unfinished_form(api, call);
    SuggestedPlaces places;
    api.service.alone(kProposing, [&] { places = suggest_places(form); });
    return Response{.body = dump({{"spheres", to_json(places.spheres)},
                                  {"predicted_mean_mm", places.mean_mm},
                                  {"predicted_u95_mm", places.u95_mm}})};
  });
}

Answer write_cell(Api& api, const Call& call) {
  const json body =
      object_in(call.request.body, {"name", "form", "instead_of", "from", "from_text", "write"});
  if (body.contains("write") && !body["write"].is_boolean())
    throw BadRequest("\"write\" must be true or false");
  const bool write = body.value("write", true);
  const std::string name = text_of(body, "name"), instead_of = text_of(body, "instead_of");
  const std::string origin = text_of(body, "from");
  std::string origin_text = text_of(body, "from_text");
  if (!origin.empty() && !origin_text.empty())
    throw BadRequest("\"from\" and \"from_text\" exclude each other");
  const std::filesystem::path from =
      origin.empty() ? std::filesystem::path() : cell_file_in(origin);
  keep_among_cells(api, call.request, from);
  return cell_act([&] {
    const std::filesystem::path file = shelf_of(api).file(name);
    const std::optional<CellFileStore::Shown> before =
        from.empty() ? shelf_of(api).find(name) : CellFileStore::read(from);
    const CellForm form = form_from_json(body.value("form", json()), file,
                                         before && before->form ? &*before->form : nullptr);
    const std::vector<calib::Phrase> warnings = CellFileStore::validate(form);
    if (!from.empty() && before && before->form) origin_text = before->text;
    if (from.empty() && !origin_text.empty()) (void)uploaded_cell(origin_text, "cell file");
    if (write) {
      api.service.alone(kWriting,
                        [&] { shelf_of(api).write(name, form, instead_of, origin_text); });
      spdlog::info("cell file {} was written", file.string());
    }
    return Response{write ? 201 : 200, "application/json",
                    dump({{"file", file.string()},
                          {"written", write},
                          {"warnings", all_words(warnings)},
                          {"form", to_json(form)}})};
  });
}

}  // namespace

std::size_t Api::largest_body(const Request& request) {
  constexpr std::size_t kMegabyte = std::size_t{1} << 20;
  if (request.path == "/v1/cell-form/mesh") return 8 * kMegabyte;
  return request.path.starts_with("/v1/cell-form") ? 2 * kMegabyte : 0;
}

std::span<const Api::Route> cell_form_routes() {
  static constexpr Api::Route kRoutes[] = {
      {"GET", "/v1/cell-form", Role::kOperate, kSlow, show_cell_form},
      {"POST", "/v1/cell-form/lists", Role::kOperate, kSlow, read_cell_lists},
      {"POST", "/v1/cell-form/robot", Role::kOperate, kSlow, import_robot},
      {"POST", "/v1/cell-form/mesh", Role::kOperate, kSlow, keep_mesh},
      {"POST", "/v1/cell-form/read", Role::kOperate, kSlow, read_cell_file},
      {"POST", "/v1/cell-form/scene", Role::kOperate, kSlow, draw_cell_form},
      {"POST", "/v1/cell-form/places", Role::kOperate, kSlow, suggest_places_of_form},
      {"POST", "/v1/cell-form", Role::kOperate, kSlow, write_cell},
  };
  return kRoutes;
}

}  // namespace cellcal::daemon
